/** Forward kinematics: rotations of joints in their parents' frames to places. */

import type { Vec3 } from "../project/model";

/** w, x, y, z. */
type Turn = readonly [number, number, number, number];

export interface Bones {
  readonly parents: readonly number[];
  readonly offsets: readonly Vec3[];
}

/** Places of all joints in the world, (joints * 3) metres. */
export function placesOf(bones: Bones, root: Vec3, rotations: readonly Turn[]): Float32Array {
  const places = new Float32Array(bones.parents.length * 3);
  const turns: Turn[] = [];
  bones.parents.forEach((parent, joint) => {
    const own = rotations[joint]!;
    turns[joint] = parent < 0 ? own : multiplied(turns[parent]!, own);
    const arm = parent < 0 ? root : rotated(turns[parent]!, bones.offsets[joint]!);
    for (let axis = 0; axis < 3; axis += 1) {
      places[joint * 3 + axis] = arm[axis]! + (parent < 0 ? 0 : places[parent * 3 + axis]!);
    }
  });
  return places;
}

function multiplied([a, b, c, d]: Turn, [e, f, g, h]: Turn): Turn {
  return [
    a * e - b * f - c * g - d * h,
    a * f + b * e + c * h - d * g,
    a * g - b * h + c * e + d * f,
    a * h + b * g - c * f + d * e,
  ];
}

function rotated([w, x, y, z]: Turn, [a, b, c]: Vec3): Vec3 {
  const [u, v, t] = [2 * (y * c - z * b), 2 * (z * a - x * c), 2 * (x * b - y * a)];
  return [a + w * u + y * t - z * v, b + w * v + z * u - x * t, c + w * t + x * v - y * u];
}
