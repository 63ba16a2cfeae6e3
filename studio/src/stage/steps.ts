/** Steps under somebody who goes up or down (`motionloom.kinematics.stairs`), as solid blocks on the floor. */

import * as THREE from "three";
import { type MotionClip, POSE } from "../body/clip";
import { COUNT, PELVIS, SIDES } from "../body/skeleton";
import { isUp, stairs } from "../prior/stairs";
import type { Vec } from "../prior/turns";
import type { StageTheme } from "./theme";

/** Metres from side to side, and of one step from front to back at least and at most. */
const WIDE = 0.95;
const [SHORT, LONG] = [0.24, 0.5];

export interface Step {
  readonly x: number;
  readonly z: number;
  readonly height: number;
  /** Metres along the way up. */
  readonly deep: number;
  /** Radians from +Z towards +X of the way. */
  readonly yaw: number;
}

/** The height of the lowest joint in each frame. */
function lowest(data: Float32Array): number[] {
  const low = new Array<number>(data.length / POSE).fill(Infinity);
  for (let n = 1; n < data.length; n += 3) low[Math.floor(n / POSE)] = Math.min(low[Math.floor(n / POSE)]!, data[n]!);
  return low;
}

/** The steps that the people of a motion tread on; none where they stay on the floor. */
export function stepsOf(clip: MotionClip): Step[] {
  return clip.people.flatMap((data) => {
    // Most motions stay on the floor, and long ones are long lists of places.
    if (!isUp(lowest(data), clip.fps)) return [];
    const places = Array.from({ length: clip.frames }, (_, frame) =>
      Array.from({ length: COUNT }, (_, joint): Vec => {
        const at = (frame * COUNT + joint) * 3;
        return [data[at]!, data[at + 1]!, data[at + 2]!];
      }),
    );
    const found = stairs(places, clip.fps);
    if (!found) return [];
    // Of each level, where the feet and the hips are on it.
    const levels = new Map<number, [THREE.Vector2, THREE.Vector2][]>();
    found.holds.forEach(({ side, first, end }, n) => {
      const pose = places[Math.floor((first + end) / 2)]!;
      const { ankle, foot } = SIDES[side]!;
      const at = over(pose[ankle]!).add(over(pose[foot]!)).divideScalar(2);
      levels.set(found.levels[n]!, [...(levels.get(found.levels[n]!) ?? []), [at, over(pose[PELVIS]!)]]);
    });
    const treads = [...levels].sort(([a], [b]) => a - b);
    const [feet, hips] = [0, 1].map((k) =>
      treads.map(([, all]) => all.reduce((sum, one) => sum.add(one[k]!), new THREE.Vector2()).divideScalar(all.length)),
    ) as [THREE.Vector2[], THREE.Vector2[]];
    return treads.flatMap(([level], n) => {
      if (level < 1) return [];
      const [before, behind] = [Math.max(n - 1, 0), Math.min(n + 1, treads.length - 1)];
      const way = hips[behind]!.clone().sub(hips[before]!);
      const deep = Math.min(Math.max(way.length() / Math.max(behind - before, 1), SHORT), LONG);
      // A step is before the hips, not to the side on which the foot is.
      const ahead = way.normalize().dot(feet[n]!.clone().sub(hips[n]!));
      const { x, y: z } = hips[n]!.clone().addScaledVector(way, ahead);
      return [{ x, z, height: level * found.rise, deep, yaw: Math.atan2(way.x, way.y) }];
    });
  });
}

/** A place seen from above. */
function over([x, , z]: Vec): THREE.Vector2 {
  return new THREE.Vector2(x, z);
}

export class Steps {
  private readonly group = new THREE.Group();
  private readonly material: THREE.MeshStandardMaterial;
  private clip: MotionClip | null = null;

  constructor(scene: THREE.Scene, theme: StageTheme) {
    this.material = new THREE.MeshStandardMaterial({ color: theme.steps, roughness: 0.9 });
    scene.add(this.group);
  }

  /** How many there are. */
  get count(): number {
    return this.group.children.length;
  }

  look(theme: StageTheme): void {
    this.material.color.set(theme.steps);
  }

  /** The steps of a motion; null: none. */
  show(clip: MotionClip | null): void {
    if (clip === this.clip) return;
    this.clip = clip;
    for (const one of this.group.children) (one as THREE.Mesh).geometry.dispose();
    this.group.clear();
    for (const { x, z, height, deep, yaw } of clip ? stepsOf(clip) : []) {
      const block = new THREE.Mesh(new THREE.BoxGeometry(WIDE, height, deep), this.material);
      block.position.set(x, height / 2, z);
      block.rotation.y = yaw;
      block.castShadow = block.receiveShadow = true;
      this.group.add(block);
    }
  }
}
