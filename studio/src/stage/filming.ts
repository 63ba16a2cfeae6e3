/** Pictures of the stage for a film: picture by picture at its own times, whatever the machine can do in real time. */

import type { Vector3 } from "three";
import { type App, duration, shownClip } from "../app/app";
import { NOTHING, type Session } from "../app/session";
import { jointAt } from "../body/clip";
import { PELVIS } from "../body/skeleton";
import { clamp } from "../project/model";
import type { FilmFormat } from "../server/film";
import type { Scene } from "./scene";

/** How the camera goes: as somebody set it, or once around the people. */
export type Way = "kept" | "around";

/** Milliseconds in which a following camera comes nearer by two thirds. */
export const FOLLOWING = 220;

/** Seconds that are filmed: what is marked, or all. */
export function stretch(app: App): readonly [number, number] {
  return app.session.value.range ?? [0, duration(app)];
}

/** The pictures of a film; `end` brings back what was seen before it. */
export class Filming {
  private readonly begin: number;
  private readonly before: Session;
  private readonly camera: Vector3;
  private readonly target: Vector3;

  constructor(
    private readonly app: App,
    private readonly scene: Scene,
    private readonly asked: FilmFormat,
    private readonly way: Way,
  ) {
    this.begin = stretch(app)[0];
    this.before = app.session.value;
    this.camera = scene.camera.position.clone();
    this.target = scene.orbit.target.clone();
    app.session.update({ playing: false, tool: "select", selection: NOTHING, views: null });
    scene.film([asked.width, asked.height]);
  }

  /** The n-th picture; they are drawn in their order. */
  picture(number: number): Promise<Blob> {
    const time = clamp(this.begin + number / this.asked.fps, 0, duration(this.app));
    this.app.session.update({ time });
    const clip = shownClip(this.app);
    const follows = this.way === "around" || this.before.follow;
    if (clip) {
      const all = this.way === "around" ? clip.people.map((_, person) => person) : [0];
      const places = all.map((person) => jointAt(clip, person, PELVIS, time));
      const [x, z] = [0, 2].map((axis) => places.reduce((sum, place) => sum + place[axis]!, 0) / places.length);
      this.scene.centre(x!, z!, follows, number ? 1 - Math.exp(-1000 / this.asked.fps / FOLLOWING) : 1);
    }
    if (this.way === "around" && number) this.scene.turn((2 * Math.PI) / this.asked.count);
    return this.scene.shot();
  }

  end(): void {
    this.scene.camera.position.copy(this.camera);
    this.scene.orbit.target.copy(this.target);
    this.scene.film(null);
    const { time, playing, tool, selection, views } = this.before;
    this.app.session.update({ time, playing, tool, selection, views });
  }
}
