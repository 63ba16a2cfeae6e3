/** Poses as places of 22 joints: several joints moved together, mirrored, put elsewhere, and mixed. */

import type { Vec3 } from "../project/model";
import { places } from "./clip";
import { reach } from "./reach";
import { COUNT, LEFT, PARENTS, PELVIS, RIGHT, SIDES } from "./skeleton";

type Places = readonly Vec3[];

/** The joint at the other side, or the same in the middle. */
const OPPOSITE = Array.from({ length: COUNT }, (_, joint) => {
  const side = SIDES.findIndex((one) => Object.values(one).includes(joint));
  if (side < 0) return joint;
  const name = Object.entries(SIDES[side]!).find(([, value]) => value === joint)![0] as keyof typeof LEFT;
  return SIDES[1 - side]![name];
});

/** The pose with joints moved by the same way, as far as their limbs go; `pins` stay, as far as theirs do. */
export function moved(pose: Places, joints: readonly number[], way: Vec3, pins: readonly number[]): Vec3[] {
  const asked = [
    ...[...joints].sort((a, b) => a - b).map((joint) => [joint, plus(pose[joint]!, way)] as const),
    ...pins.filter((pin) => !joints.includes(pin)).map((pin) => [pin, pose[pin]!] as const),
  ];
  const start: Float32Array = Float32Array.from(pose.flat());
  return places(asked.reduce((now, [joint, to]) => reach(now, joint, to, true).pose, start));
}

/** Left and right exchanged, where the pose is and as it faces. */
export function mirrored(pose: Places): Vec3[] {
  const [x, , z] = pose[PELVIS]!;
  const angle = (facing(pose) * Math.PI) / 180;
  // What is to the left of the pelvis, along the line of the hips.
  const [ax, az] = [Math.cos(angle), -Math.sin(angle)];
  return OPPOSITE.map((other) => {
    const [px, py, pz] = pose[other]!;
    const left = (px - x) * ax + (pz - z) * az;
    return rounded([px - 2 * left * ax, py, pz - 2 * left * az]);
  });
}

/** The pose with its pelvis over a place, turned so that it faces `degrees`. */
export function turnedTo(pose: Places, [x, z]: readonly [number, number], degrees: number): Vec3[] {
  const angle = ((degrees - facing(pose)) * Math.PI) / 180;
  const [c, s] = [Math.cos(angle), Math.sin(angle)];
  const [ox, , oz] = pose[PELVIS]!;
  return pose.map(([px, y, pz]) => rounded([x + (px - ox) * c + (pz - oz) * s, y, z - (px - ox) * s + (pz - oz) * c]));
}

/** `count` poses evenly between two, with bones as long as theirs. */
export function between(from: Places, to: Places, count: number): Vec3[][] {
  return Array.from({ length: count }, (_, index) => mixed(from, to, (index + 1) / (count + 1)));
}

function mixed(from: Places, to: Places, share: number): Vec3[] {
  const result: Vec3[] = [];
  PARENTS.forEach((parent, joint) => {
    const line = from[joint]!.map((one, axis) => one + (to[joint]![axis]! - one) * share) as unknown as Vec3;
    if (parent < 0) return void result.push(line);
    const bone = (pose: Places) => minus(pose[joint]!, pose[parent]!);
    const [a, b] = [bone(from), bone(to)];
    const way = a.map((one, axis) => one + (b[axis]! - one) * share) as unknown as Vec3;
    const size = norm(a) + (norm(b) - norm(a)) * share;
    result.push(plus(result[parent]!, way, size / Math.max(norm(way), 1e-6)));
  });
  return result.map(rounded);
}

/** Degrees that a pose faces, by the hips; 0 is +Z and 90 is +X. */
function facing(pose: Places): number {
  const [left, right] = [pose[LEFT.hip]!, pose[RIGHT.hip]!];
  return (Math.atan2(right[2] - left[2], left[0] - right[0]) * 180) / Math.PI;
}

function plus(a: Vec3, b: Vec3, scale = 1): Vec3 {
  return [a[0] + b[0] * scale, a[1] + b[1] * scale, a[2] + b[2] * scale];
}

function minus(a: Vec3, b: Vec3): Vec3 {
  return plus(a, b, -1);
}

function norm(a: Vec3): number {
  return Math.hypot(...a);
}

function rounded(place: Vec3): Vec3 {
  return place.map((one) => Math.round(one * 1000) / 1000) as unknown as Vec3;
}
