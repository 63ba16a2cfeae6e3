/** The people of a take on the studio's stage, and cameras around them. */

import * as THREE from "three";
import type { Signal } from "../app/signal";
import { type MotionClip, facingAt, jointAt } from "../body/clip";
import { HEAD, PELVIS } from "../body/skeleton";
import { setTime } from "../stage/actor";
import { Cast } from "../stage/cast";
import { Scene } from "../stage/scene";
import { DARK, GHOSTS, LIGHT } from "../stage/theme";
import { Trails } from "../stage/trails";
import type { Take } from "./data";
import type { View } from "./view";

/** Where a camera stands: degrees from where the person faces, and degrees above the floor. */
export const CAMERAS = {
  around: [35, 13],
  front: [0, 6],
  side: [90, 6],
  above: [180, 88],
} as const;
export type Camera = keyof typeof CAMERAS;

/** Heights that the stage is made for, metres over the floor: of the head's joint, and of all of a person. */
const [TALL, TOP] = [1.55, 1.8];
const RADIANS = Math.PI / 180;

export class ViewStage {
  readonly scene: Scene;
  private readonly cast: Cast;
  private readonly trails: Trails;
  private readonly size: number;

  constructor(
    canvas: HTMLCanvasElement,
    private readonly takes: readonly Take[],
    private readonly view: Signal<View>,
  ) {
    const theme = view.value.dark ? DARK : LIGHT;
    this.scene = new Scene(canvas, theme);
    this.cast = new Cast(this.scene.scene, theme, Math.max(...takes.map((take) => take.clip?.people.length ?? 0)));
    this.trails = new Trails(this.scene.scene, theme);
    for (const { root } of takes.flatMap((take) => take.actors)) this.scene.scene.add(root);
    this.size = takes[0] ? sizeOf(takes[0]) : 1;
    this.scene.orbit.minDistance = 0.8 * Math.min(this.size, 1);
    this.scene.orbit.target.y *= this.size;
    this.scene.step = (elapsed) => this.step(elapsed);
    this.look("around");
    this.shown();
  }

  get take(): Take {
    return this.takes[this.view.value.take]!;
  }

  theme(dark: boolean): void {
    const theme = dark ? DARK : LIGHT;
    this.scene.look(theme);
    this.cast.look(theme);
    this.trails.look(theme);
  }

  /** Stand in front of the people, at their side, or above them, as they are now. */
  look(name: Camera): void {
    const { clip } = this.take;
    const { time } = this.view.value;
    const [turn, up] = CAMERAS[name];
    const angle = (turn + (clip ? facingAt(clip, 0, time) : 0)) * RADIANS;
    const { orbit, camera } = this.scene;
    const [x, z] = middle(clip, time);
    orbit.target.set(x, 0.86 * this.size, z);
    const room = clip && clip.people.length > 1 ? spread(clip, time) : 0;
    const narrow = Math.max(1, 1.1 / camera.aspect);
    const away = (4.1 * this.size + room) * narrow * (name === "above" ? 1.4 : 1);
    const arm = new THREE.Vector3(0, Math.sin(up * RADIANS), Math.cos(up * RADIANS)).multiplyScalar(away);
    camera.position.copy(orbit.target).add(arm.applyAxisAngle(new THREE.Vector3(0, 1, 0), angle));
    this.scene.invalidate();
  }

  /** What depends on more than the time. */
  shown(): void {
    const { trails, ghosts, take } = this.view.value;
    this.trails.show(trails ? this.take.clip : null);
    this.takes.forEach((one, index) => index !== take && setTime(one.actors, 0, false));
    if (!ghosts) this.cast.showGhosts([], 0);
    this.place();
  }

  /** Everybody where they are at the playhead. */
  place(): void {
    const { time, ghosts } = this.view.value;
    const { clip, actors } = this.take;
    setTime(actors, time, true);
    this.cast.show(clip, time, actors.length > 0);
    if (ghosts) {
      const others = this.takes.flatMap((one, index) =>
        one.clip && one !== this.take ? [{ clip: one.clip, color: GHOSTS[index % GHOSTS.length]! }] : [],
      );
      this.cast.showGhosts(others, time);
    }
    this.scene.invalidate();
  }

  /** One frame of real time. */
  private step(elapsed: number): boolean {
    const { playing, time, rate, repeat, follow } = this.view.value;
    const { seconds, clip } = this.take;
    if (playing) {
      const next = time + (elapsed / 1000) * rate;
      if (next < seconds) this.view.update({ time: next });
      else this.view.update(repeat ? { time: next % seconds } : { time: seconds, playing: false });
    }
    const before = this.scene.orbit.target.clone();
    const [x, z] = middle(clip, this.view.value.time);
    this.scene.centre(x, z, follow && clip !== null, 1 - Math.exp(-elapsed / 220));
    return playing || before.distanceToSquared(this.scene.orbit.target) > 1e-7;
  }
}

/** How large people are, as the mannequin is 1; a character may have a large head, a hat or ears. */
function sizeOf({ clip, actors }: Take): number {
  if (!clip) return 1;
  const head = jointAt(clip, 0, HEAD, 0)[1] / TALL;
  const room = new THREE.Box3();
  for (const { root } of actors) room.expandByObject(root);
  const top = room.isEmpty() ? 0 : (room.max.y - room.min.y) / TOP;
  return Math.min(Math.max(head, Math.min(top, 3 * head), 0.1), 10);
}

/** Between the pelvises of everybody, over the floor. */
function middle(clip: MotionClip | null, time: number): [number, number] {
  const places = clip?.people.map((_, person) => jointAt(clip, person, PELVIS, time)) ?? [[0, 0, 0]];
  const mean = (axis: number) => places.reduce((sum, place) => sum + place[axis]!, 0) / places.length;
  return [mean(0), mean(2)];
}

/** How far everybody is from the middle at most. */
function spread(clip: MotionClip, time: number): number {
  const [x, z] = middle(clip, time);
  const far = clip.people.map((_, person) => {
    const at = jointAt(clip, person, PELVIS, time);
    return Math.hypot(at[0] - x, at[2] - z);
  });
  return Math.max(...far);
}
