/**
 * The pose that a target asks for, as a preview: the joint is carried to the target and the limb follows with its own
 * bone lengths. What is drawn afterwards is the server's affair.
 */

import type { Vec3 } from "../project/model";
import { POSE, vec } from "./clip";
import { COUNT, HEAD, NECK, PARENTS, PELVIS, SIDES, SPINE1, SPINE2, SPINE3 } from "./skeleton";

/** From what stays to what is dragged; the first joint of a chain does not move unless the target is out of reach. */
const CHAINS: Record<number, readonly number[]> = {
  [HEAD]: [PELVIS, SPINE1, SPINE2, SPINE3, NECK, HEAD],
  ...Object.assign(
    {},
    ...SIDES.map(({ hip, knee, ankle, foot, collar, shoulder, elbow, wrist }) => ({
      [wrist]: [shoulder, elbow, wrist],
      [elbow]: [shoulder, elbow],
      [shoulder]: [SPINE3, collar, shoulder],
      [ankle]: [hip, knee, ankle],
      [foot]: [hip, knee, ankle, foot],
      [knee]: [hip, knee],
    })),
  ),
};

const ROUNDS = 12;

export interface Reached {
  readonly pose: Float32Array;
  /** Metres that the whole body had to move because the limb is too short. */
  readonly moved: number;
}

/** The pose with `joint` at `target`; with `stays`, only as near to it as the limb goes, since the body stays. */
export function reach(pose: Float32Array, joint: number, target: Vec3, stays = false): Reached {
  const result = Float32Array.from(pose);
  const chain = CHAINS[joint] ?? [joint];
  const missing = stays ? 0 : missingLength(result, chain, target);
  if (missing > 0) shift(result, towards(vec(result, chain[0]!), target, missing));
  if (chain.length > 1) fabrik(result, chain, target);
  else shift(result, minus(target, vec(result, joint)));
  return { pose: result, moved: chain.length > 1 ? Math.max(missing, 0) : 0 };
}

function missingLength(pose: Float32Array, chain: readonly number[], target: Vec3): number {
  const reachable = lengths(pose, chain).reduce((sum, one) => sum + one, 0);
  return norm(minus(target, vec(pose, chain[0]!))) - reachable * 0.999;
}

/** Forward and backward reaching (Aristidou and Lasenby 2011); what hangs on a moved joint moves along. */
function fabrik(pose: Float32Array, chain: readonly number[], target: Vec3): void {
  const sizes = lengths(pose, chain);
  const points = chain.map((one) => vec(pose, one));
  const root = points[0]!;
  for (let round = 0; round < ROUNDS; round += 1) {
    points[points.length - 1] = target;
    for (let n = points.length - 2; n >= 0; n -= 1) points[n] = at(points[n + 1]!, points[n]!, sizes[n]!);
    points[0] = root;
    for (let n = 1; n < points.length; n += 1) points[n] = at(points[n - 1]!, points[n]!, sizes[n - 1]!);
    if (norm(minus(points.at(-1)!, target)) < 1e-4) break;
  }
  chain.forEach((one, index) => {
    const change = minus(points[index]!, vec(pose, one));
    for (const other of below(one, chain[index + 1])) add(pose, other, change);
  });
}

/** A joint and what hangs on it, without the branch that begins at `except`. */
function below(joint: number, except: number | undefined): number[] {
  const found = [joint];
  for (let other = joint + 1; other < COUNT; other += 1) {
    if (other !== except && found.includes(PARENTS[other]!)) found.push(other);
  }
  return found;
}

function lengths(pose: Float32Array, chain: readonly number[]): number[] {
  return chain.slice(1).map((one, index) => norm(minus(vec(pose, one), vec(pose, chain[index]!))));
}

function shift(pose: Float32Array, change: Vec3): void {
  for (let joint = 0; joint < POSE / 3; joint += 1) add(pose, joint, change);
}

function add(pose: Float32Array, joint: number, change: Vec3): void {
  for (let axis = 0; axis < 3; axis += 1) pose[joint * 3 + axis]! += change[axis]!;
}

/** The place at `size` from `from` towards `to`. */
function at(from: Vec3, to: Vec3, size: number): Vec3 {
  const way = minus(to, from);
  const scale = size / Math.max(norm(way), 1e-9);
  return [from[0] + way[0] * scale, from[1] + way[1] * scale, from[2] + way[2] * scale];
}

function towards(from: Vec3, to: Vec3, metres: number): Vec3 {
  return minus(at(from, to, metres), from);
}

function minus(a: Vec3, b: Vec3): Vec3 {
  return [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
}

function norm(a: Vec3): number {
  return Math.hypot(a[0], a[1], a[2]);
}
