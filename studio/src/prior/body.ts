/** Places of 22 joints to a person with constant bones and true turns (`motionloom.core.body.ik`). */

import { aim, solveLimbs, withKneesAhead } from "./limbs";
import {
  type Body,
  HEAD,
  LEFT,
  LENGTHS,
  LIMBS,
  NECK,
  PARENTS,
  PELVIS,
  REST,
  RIGHT,
  SPINE1,
  SPINE2,
  SPINE3,
  TRUNK,
} from "./person";
import {
  IDENTITY,
  type Turn,
  type Vec,
  aboutAxis,
  add,
  clip,
  eigen,
  inverse,
  minus,
  norm,
  normalized,
  rotate,
  scaled,
  slerp,
  times,
  tridiagonal,
  unroll,
} from "./turns";

/** Relative error of sampled lengths at which a turn counts as much as its change from frame to frame. */
const TOLERANCE = 0.12;
/** How much each place of the trunk says about where all of it is; the pelvis first, then as in `TRUNK`. */
const SAYS = [1, 1, 1, 1, 2, 0, 0, 2, 2];

/** The person who takes the given places, frame by frame, as well as constant bones can. */
export function bodyOf(sampled: Vec[][], fps: number): Body {
  const seen = withKneesAhead(sampled);
  const places: Vec[][] = seen.map((frame) => frame.map(() => [0, 0, 0] as const));
  const world: Turn[][] = seen.map((frame) => frame.map(() => IDENTITY));
  solveTrunk(seen, places, world);
  solveLimbs(seen, places, world, fps);
  const turns = world.map((frame) =>
    PARENTS.map((parent, j) => normalized(parent < 0 ? frame[j]! : times(inverse(frame[parent]!), frame[j]!))),
  );
  eachJoint(turns, unroll);
  smoothLimbs(seen, turns);
  return { fps, root: places.map((frame) => frame[PELVIS]!), turns };
}

/** Change the turns of each joint over time, in place. */
export function eachJoint(turns: Turn[][], change: (own: Turn[]) => Turn[]): void {
  for (const joint of PARENTS.keys()) setJoint(turns, joint, change(column(turns, joint)));
}

const column = <T>(frames: readonly T[][], joint: number): T[] => frames.map((frame) => frame[joint]!);

function setJoint<T>(frames: T[][], joint: number, values: readonly T[]): void {
  values.forEach((value, f) => (frames[f]![joint] = value));
}

function solveTrunk(seen: Vec[][], places: Vec[][], world: Turn[][]): void {
  const bone = (a: number, b: number): Vec[] => seen.map((at) => minus(at[a]!, at[b]!));
  const wide = (a: number, b: number): Vec => minus(REST[a]!, REST[b]!);
  const shoulders = add(wide(LEFT.shoulder, RIGHT.shoulder), wide(LEFT.collar, RIGHT.collar));
  const hips = fitted(seen, PELVIS, [LEFT.hip, RIGHT.hip, SPINE1], shoulders, bone(LEFT.shoulder, RIGHT.shoulder));
  setJoint(world, PELVIS, smoothed(hips, missing(bone(LEFT.hip, RIGHT.hip), wide(LEFT.hip, RIGHT.hip))));
  const [collars, rest] = [bone(LEFT.collar, RIGHT.collar), wide(LEFT.collar, RIGHT.collar)];
  const chest = fitted(seen, SPINE3, [NECK, LEFT.collar, RIGHT.collar], rest, collars);
  setJoint(world, SPINE3, smoothed(chest, missing(collars, rest)));
  for (const [joint, child, share] of [[SPINE1, SPINE2, 1 / 3] as const, [SPINE2, SPINE3, 2 / 3] as const]) {
    const bones = bone(child, joint);
    const lean = Math.min(2, (6 * spread(bones.map(norm))) / LENGTHS[child]!);
    world.forEach((turns, f) => {
      const expected = slerp(turns[PELVIS]!, turns[SPINE3]!, share);
      turns[joint] = aim(expected, REST[child]!, add(bones[f]!, rotate(expected, REST[child]!), lean));
    });
  }
  seen.forEach((at, f) => placeTrunk(at, places[f]!, world[f]!));
  for (const [joint, child] of [
    [NECK, HEAD] as const,
    [LEFT.collar, LEFT.shoulder] as const,
    [RIGHT.collar, RIGHT.shoulder] as const,
  ]) {
    const sampled = seen.map((at, f) => minus(at[child]!, places[f]![joint]!));
    const error = missing(sampled, REST[child]!);
    const local = world.map((turns, f) => {
      const usual = rotate(turns[SPINE3]!, REST[child]!);
      const turned = aim(turns[SPINE3]!, REST[child]!, add(sampled[f]!, usual, 2 * error[f]!));
      return times(inverse(turns[SPINE3]!), turned);
    });
    smoothed(local, error).forEach((turn, f) => {
      world[f]![joint] = times(world[f]![SPINE3]!, turn);
      places[f]![child] = endOf(child, places[f]!, world[f]!);
    });
  }
  const level = levelHead(world);
  for (const turns of world) turns[HEAD] = times(turns[NECK]!, level);
}

/** The trunk's joints on its bones, and all of it where the seen places are on average. */
function placeTrunk(seen: readonly Vec[], places: Vec[], world: readonly Turn[]): void {
  for (const joint of TRUNK) places[joint] = endOf(joint, places, world);
  const all = [PELVIS, ...TRUNK];
  const total = SAYS.reduce((sum, one) => sum + one, 0);
  const shift = all.reduce<Vec>((sum, j, n) => add(sum, minus(seen[j]!, places[j]!), SAYS[n]! / total), [0, 0, 0]);
  for (const joint of all) places[joint] = add(places[joint]!, shift);
}

function endOf(joint: number, places: readonly Vec[], world: readonly Turn[]): Vec {
  const parent = PARENTS[joint]!;
  return add(places[parent]!, rotate(world[parent]!, REST[joint]!));
}

/** The turn of the head on the neck, the same for all frames: a neck that leans back all the time means a level head. */
function levelHead(world: readonly Turn[][]): Turn {
  const leans = world.map((turns) => {
    const up = rotate(times(inverse(turns[SPINE3]!), turns[NECK]!), [0, 1, 0]);
    return Math.atan2(up[2], up[1]);
  });
  return aboutAxis([1, 0, 0], -clip(percentile(leans, 50), (-50 * Math.PI) / 180, 0));
}

/** Between the nearest two of the numbers, as NumPy counts percentiles. */
export function percentile(numbers: readonly number[], percent: number): number {
  const sorted = [...numbers].sort((a, b) => a - b);
  const at = ((sorted.length - 1) * percent) / 100;
  const low = Math.floor(at);
  return sorted[low]! + (at - low) * ((sorted[low + 1] ?? sorted[low]!) - sorted[low]!);
}

function spread(numbers: readonly number[]): number {
  const mean = numbers.reduce((sum, x) => sum + x, 0) / numbers.length;
  return Math.sqrt(numbers.reduce((sum, x) => sum + (x - mean) ** 2, 0) / numbers.length);
}

/** By how much a sampled bone is shorter than its own, in units of that. */
function shortness(bone: Vec, length: number): number {
  return Math.max(1 - norm(bone) / length, 0);
}

function missing(bones: readonly Vec[], rest: Vec): number[] {
  return bones.map((bone) => shortness(bone, norm(rest)));
}

/** Turns smoothed in time as far as what they were read off is too short. */
function smoothed(turns: Turn[], error: readonly number[]): Turn[] {
  const weight = error.map((one) => (TOLERANCE / Math.max(one, 1e-6)) ** 2);
  const right = unroll([...turns]).map((turn, f) => turn.map((x) => weight[f]! * x));
  return tridiagonal(weight, 1, right).map(normalized);
}

/** Hips, knees, shoulders and elbows smooth where their limb was sampled too short, in place. */
function smoothLimbs(seen: readonly Vec[][], turns: Turn[][]): void {
  for (const { start, middle, end } of LIMBS) {
    const error = seen.map((at) => {
      const upper = shortness(minus(at[middle]!, at[start]!), LENGTHS[middle]!);
      return (upper + shortness(minus(at[end]!, at[middle]!), LENGTHS[end]!)) / 2;
    });
    for (const joint of [start, middle]) setJoint(turns, joint, smoothed(column(turns, joint), error));
  }
}

/**
 * World turns that best carry the rest bones of a joint's children to where they are seen (Kabsch 1976, by Horn's
 * quaternion). Where those lie on a line the spare pair of vectors, at rest and seen, gives what is missing.
 */
function fitted(seen: readonly Vec[][], from: number, to: readonly number[], rest: Vec, spare: readonly Vec[]): Turn[] {
  const full = eigen(outer(to.map((j) => [REST[j]!, REST[j]!])))[1]!.value;
  return seen.map((at, f) => {
    const found = outer(to.map((j) => [minus(at[j]!, at[from]!), REST[j]!]));
    const squares = [0, 1, 2].map((a) => [0, 1, 2].map((b) => found.reduce((sum, row) => sum + row[a]! * row[b]!, 0)));
    const weakness = 1 - (2 * Math.sqrt(Math.max(eigen(squares)[1]!.value, 0))) / full;
    const size = Math.max(norm(spare[f]!) * norm(rest), 1e-9);
    const extra = outer([[scaled(spare[f]!, (0.5 * full * Math.max(weakness, 0)) / size), rest]]);
    return bestTurn(found.map((row, a) => row.map((x, b) => x + extra[a]![b]!)));
  });
}

/** Sum of the products of pairs of vectors, 3 by 3. */
function outer(pairs: readonly (readonly [Vec, Vec])[]): number[][] {
  return [0, 1, 2].map((a) => [0, 1, 2].map((b) => pairs.reduce((sum, [p, q]) => sum + p[a]! * q[b]!, 0)));
}

/** The turn R with the largest trace of R^T m. */
function bestTurn(m: readonly (readonly number[])[]): Turn {
  const s = (a: number, b: number): number => m[b]![a]!;
  const [x, y, z] = [s(0, 0), s(1, 1), s(2, 2)];
  const [p, q, r] = [s(1, 2) - s(2, 1), s(2, 0) - s(0, 2), s(0, 1) - s(1, 0)];
  const [xy, yz, zx] = [s(0, 1) + s(1, 0), s(1, 2) + s(2, 1), s(2, 0) + s(0, 2)];
  return normalized(
    eigen([
      [x + y + z, p, q, r],
      [p, x - y - z, xy, zx],
      [q, xy, y - x - z, yz],
      [r, zx, yz, z - x - y],
    ])[0]!.vector,
  );
}
