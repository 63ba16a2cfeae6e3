/** Who is on the stage: the people of the motion, or the body that is being denoised, and ghosts. */

import * as THREE from "three";
import { type MotionClip, POSE, lookAt, poseAt } from "../body/clip";
import { Mannequin } from "./mannequin";
import { type FigureLook, type StageTheme } from "./theme";

export interface Ghost {
  readonly clip: MotionClip;
  readonly color: string;
  /** Seconds from the playhead; 0 where it is not said. */
  readonly apart?: number;
}

const GHOST_OPACITY = 0.3;

export class Cast {
  readonly people: Mannequin[];
  private readonly ghosts: Mannequin[] = [];
  private readonly asked: Mannequin;
  private readonly pose = new Float32Array(POSE);
  private readonly looked = new Float32Array(3);

  constructor(
    private readonly scene: THREE.Scene,
    private theme: StageTheme,
    count: number = theme.people.length,
  ) {
    this.people = Array.from({ length: count }, (_, index) => this.add(lookOf(theme, index)));
    this.asked = this.add(ghostLook(theme.met, 0.42));
    this.asked.group.visible = false;
  }

  look(theme: StageTheme): void {
    this.theme = theme;
    this.people.forEach((one, index) => one.look(lookOf(theme, index)));
  }

  /** Show the people of a clip at a time; without one nobody is there. */
  show(clip: MotionClip | null, time: number, hidden = false): void {
    this.people.forEach((one, index) => {
      one.group.visible = !hidden && clip !== null && index < clip.people.length;
      if (clip && index < clip.people.length) this.place(one, clip, index, time);
    });
  }

  showGhosts(ghosts: readonly Ghost[], time: number): void {
    const bodies = ghosts.flatMap((ghost) => ghost.clip.people.map((_, person) => ({ ghost, person })));
    while (this.ghosts.length < bodies.length) this.ghosts.push(this.add(ghostLook("#888888", GHOST_OPACITY)));
    this.ghosts.forEach((one, index) => {
      const body = bodies[index];
      one.group.visible = body !== undefined;
      if (!body) return;
      one.look(ghostLook(body.ghost.color, GHOST_OPACITY));
      this.place(one, body.ghost.clip, body.person, time + (body.ghost.apart ?? 0));
    });
  }

  /** The pose that a target or a keyframe asks for; null: none. */
  showAsked(pose: Float32Array | null, met = true): void {
    this.asked.group.visible = pose !== null;
    if (!pose) return;
    this.asked.look(ghostLook(met ? this.theme.met : this.theme.unmet, 0.42));
    this.asked.pose(pose);
  }

  private place(one: Mannequin, clip: MotionClip, person: number, time: number): void {
    one.pose(poseAt(clip, person, time, this.pose), lookAt(clip, person, time, this.looked));
  }

  private add(look: FigureLook): Mannequin {
    const figure = new Mannequin(look);
    figure.group.visible = false;
    this.scene.add(figure.group);
    return figure;
  }
}

/** Of the first and the second by turns. */
function lookOf(theme: StageTheme, person: number): FigureLook {
  return theme.people[person % theme.people.length]!;
}

function ghostLook(color: string, opacity: number): FigureLook {
  return { body: color, joints: color, opacity };
}
