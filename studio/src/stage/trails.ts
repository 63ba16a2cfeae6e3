/** Where pelvis, hands and feet go, as lines in the air. */

import type * as THREE from "three";
import { type MotionClip, jointAt } from "../body/clip";
import { LEFT, PELVIS, RIGHT } from "../body/skeleton";
import { Line } from "./lines";
import type { StageTheme } from "./theme";

const JOINTS = [PELVIS, LEFT.wrist, RIGHT.wrist, LEFT.foot, RIGHT.foot];

export class Trails {
  private readonly lines: Line[];

  constructor(scene: THREE.Scene, theme: StageTheme) {
    this.lines = [0, 1].flatMap((person) => JOINTS.map(() => new Line(theme.path[person]!, 1.5, 0.6)));
    scene.add(...this.lines.map((line) => line.object));
  }

  look(theme: StageTheme): void {
    this.lines.forEach((line, index) => line.color(theme.path[index < JOINTS.length ? 0 : 1]!));
  }

  show(clip: MotionClip | null): void {
    this.lines.forEach((line, index) => {
      const person = index < JOINTS.length ? 0 : 1;
      const joint = JOINTS[index % JOINTS.length]!;
      if (!clip || person >= clip.people.length) return line.through([]);
      line.through(Array.from({ length: clip.frames }, (_, frame) => jointAt(clip, person, joint, frame / clip.fps)));
    });
  }
}
