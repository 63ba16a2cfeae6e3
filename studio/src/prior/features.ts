/** The 263 numbers of HumanML3D to places (`motionloom.core.features.humanml`). */

import type { Vec } from "./turns";

/** Numbers per frame, and where the four contact flags begin. */
export const WIDTH = 263;
export const CONTACTS = 259;

/** On the ground: metres, and radians about +Y from +Z towards +X. */
export interface GroundPose {
  readonly x: number;
  readonly z: number;
  readonly facing: number;
}

export const ORIGIN: GroundPose = { x: 0, z: 0, facing: 0 };

/** Places of 22 joints, frame by frame, of features that begin at a ground pose; and the pose of the frame behind them. */
export function decoded(features: ArrayLike<number>, begin: GroundPose = ORIGIN): { places: Vec[][]; end: GroundPose } {
  const frames = features.length / WIDTH;
  let { x, z, facing } = begin;
  const turned = (px: number, py: number, pz: number): Vec => {
    const [c, s] = [Math.cos(facing), Math.sin(facing)];
    return [x + c * px + s * pz, py, z + c * pz - s * px];
  };
  const places: Vec[][] = [];
  for (let f = 0; f < frames; f += 1) {
    const at = (n: number): number => features[f * WIDTH + n]!;
    const joints: Vec[] = [[x, at(3), z]];
    for (let n = 4; n < 67; n += 3) joints.push(turned(at(n), at(n + 1), at(n + 2)));
    places.push(joints);
    facing -= 2 * at(0);
    [x, , z] = turned(at(1), 0, at(2));
  }
  return { places, end: { x, z, facing } };
}

/** The flags of the feet, frame by frame. */
export function contacts(features: ArrayLike<number>): number[][] {
  return Array.from({ length: features.length / WIDTH }, (_, f) =>
    [0, 1, 2, 3].map((k) => features[f * WIDTH + CONTACTS + k]!),
  );
}

/** Weighted 1/6, 2/3, 1/6 along time, ends repeated. */
export function smooth(features: Float32Array): Float32Array {
  const last = features.length - WIDTH;
  return features.map((value, n) => {
    const [before, after] = [features[n < WIDTH ? n : n - WIDTH]!, features[n >= last ? n : n + WIDTH]!];
    return (before + 4 * value + after) / 6;
  });
}
