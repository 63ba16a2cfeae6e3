/**
 * A person bent, as little and as smoothly as it takes, until some joints are where they should be
 * (`motionloom.edits.fitting`, the part that steps and the floor need): Gauss and Newton over turns and the root's place.
 */

import { banded, bending } from "./banded";
import { FEET, plantedFeet, spans } from "./feet";
import {
  type Body,
  LEFT,
  LENGTHS,
  LIMBS,
  NECK,
  PARENTS,
  REST,
  RIGHT,
  SPINE1,
  SPINE2,
  SPINE3,
  placesOf,
} from "./person";
import { carried } from "./stances";
import {
  IDENTITY,
  type Turn,
  type Vec,
  aboutAxis,
  add,
  clip,
  cross,
  dot,
  minus,
  norm,
  rotate,
  scaled,
  times,
} from "./turns";

/** Where a joint should be, frame by frame: 1 for each coordinate that is asked, 0 for one that is free. */
export interface Target {
  readonly joint: number;
  readonly places: readonly Vec[];
  readonly asked: readonly Vec[];
}

/** Targets with the weights (1 / metres) of their coordinates. */
interface Weighted {
  readonly joint: number;
  readonly places: readonly Vec[];
  readonly weights: readonly Vec[];
}

/** Frames before and after a target that may change. */
const ROUND = 30;
/** Metres: how exactly targets are met, standing feet stand, and other feet go where they went. */
const [EXACT, STANDING, SWINGING] = [0.0005, 0.001, 0.02];
/** Frames squared: a change as large as allowed costs as much as one that accelerates by that share of it per frame². */
const SLOW = 30;
const STEPS = 12;
/** Metres: no target gets nearer by more in the last step. */
const DONE = 1e-4;
/** Metres that the root usually may go, by itself and feet and all. */
const [ROOT, LARGE] = [0.05, 0.5];
/** Radians between which knees and elbows stay, where they were. */
const BEND = [0.03, 2.6] as const;
/** Shares of a limb that are reached with ease, and at all; metres that the body leans, and goes, for more. */
const [EASY, STRETCH, LEAN, WALK] = [0.97, 0.99, 0.08, 0.5];

/** Joints that turn freely, and the radians by which they usually may. */
const BALLS: readonly (readonly [number, number])[] = [
  [0, 0.15],
  [LEFT.hip, 0.5],
  [RIGHT.hip, 0.5],
  [SPINE1, 0.15],
  [SPINE2, 0.15],
  [SPINE3, 0.15],
  [NECK, 0.2],
  [LEFT.collar, 0.1],
  [RIGHT.collar, 0.1],
  [LEFT.shoulder, 0.6],
  [RIGHT.shoulder, 0.6],
  [LEFT.ankle, 0.3],
  [RIGHT.ankle, 0.3],
];
/** The limbs whose middles bend, and the radians by which those usually may. */
const HINGES = LIMBS.map((limb, n) => ({ ...limb, size: n < 2 ? 0.6 : 0.8 }));
const FIRST_HINGE = 3 + 3 * BALLS.length;
const COLUMNS = FIRST_HINGE + HINGES.length;
const SIZES = [ROOT, ROOT, ROOT, ...BALLS.flatMap(([, size]) => [size, size, size]), ...HINGES.map(({ size }) => size)];
/** For each joint the columns whose turns move it, each with the joint that it turns about. */
const MOVED_BY: readonly (readonly [number, number][])[] = movedBy();

function movedBy(): [number, number][][] {
  const found: [number, number][][] = [[]];
  PARENTS.slice(1).forEach((parent) => {
    const [ball, hinge] = [
      BALLS.findIndex(([joint]) => joint === parent),
      HINGES.findIndex((one) => one.middle === parent),
    ];
    const own = ball >= 0 ? [0, 1, 2].map((k) => 3 + 3 * ball + k) : hinge >= 0 ? [FIRST_HINGE + hinge] : [];
    found.push([...found[parent]!, ...own.map((column): [number, number] => [column, parent])]);
  });
  return found;
}

/** The body with joints at their targets where its bones allow; frames far from all targets stay as they are. */
export function fitBody(body: Body, targets: readonly Target[]): Body {
  const places = placesOf(body);
  const off = targets.flatMap(({ joint, places: to, asked }) =>
    to.map((at, f) => Math.max(...masked(minus(at, places[f]![joint]!), asked[f]!).map(Math.abs))),
  );
  if (!(Math.max(...off, 0) >= DONE)) return body;
  const windows = around(targets, places.length);
  const shift = rootShift(places, targets, windows);
  const goal = inReach(
    places.map((at, f) => at.map((one) => add(one, shift[f]!))),
    targets,
  ).map(({ asked, ...one }): Weighted => ({ ...one, weights: asked.map((axes) => scaled(axes, 1 / EXACT)) }));
  const feet = feetOf(places, shift, targets, body.fps);
  const [root, turns] = [[...body.root], [...body.turns]];
  for (const [start, stop] of windows) {
    const crop = (one: Weighted): Weighted => ({
      joint: one.joint,
      places: one.places.slice(start, stop),
      weights: one.weights.slice(start, stop),
    });
    const pose = new Pose(body.root.slice(start, stop), body.turns.slice(start, stop));
    shift.slice(start, stop).forEach((way, f) => way.forEach((x, k) => (pose.change[f * COLUMNS + k] = x / ROOT)));
    const bands = bending(SLOW, stop - start, start > 0, stop < places.length);
    solve(pose, goal.map(crop), feet.map(crop), bands);
    for (let f = start; f < stop; f += 1) [root[f], turns[f]] = pose.posed(f - start);
  }
  return { ...body, root, turns };
}

const masked = (v: Vec, by: Vec): Vec => [v[0] * by[0], v[1] * by[1], v[2] * by[2]];
const hasTarget = (axes: Vec): boolean => axes.some((one) => one > 0);

/** Stretches of frames around targets. */
function around(targets: readonly Target[], frames: number): (readonly [number, number])[] {
  const asked = Array.from({ length: frames }, (_, f) => targets.some((one) => hasTarget(one.asked[f]!)));
  return spans(near(asked, ROUND));
}

/** Flags that are true within so many frames of one that is. */
const near = (flags: readonly boolean[], reach: number): boolean[] =>
  flags.map((_, f) => flags.slice(Math.max(f - reach, 0), f + reach + 1).includes(true));

/** The joint that another's reach is measured from, and metres of bones between. */
function chain(joint: number): [number, number] {
  const limb = LIMBS.find(({ middle, end, tip }) => joint === middle || joint === end || joint === tip);
  const base = limb ? limb.start : 0;
  let length = 0;
  for (let at = joint; at !== base; at = PARENTS[at]!) length += LENGTHS[at]!;
  return [base, length];
}

/** The targets, those out of reach brought as near to the body as it can follow them. */
function inReach(places: readonly Vec[][], targets: readonly Target[]): Target[] {
  return targets.map((one) => {
    const [base, length] = chain(one.joint);
    const moved = one.places.map((at, f): Vec => {
      const centre = places[f]![base]!;
      const line = masked(minus(at, centre), one.asked[f]!);
      const share = (STRETCH * length + LEAN) / Math.max(norm(line), 1e-9);
      if (share >= 1) return at;
      return [0, 1, 2].map((k) => (one.asked[f]![k] ? centre[k]! + line[k]! * share : at[k]!)) as unknown as Vec;
    });
    return { ...one, places: moved };
  });
}

/** Metres, horizontal, smooth: what the whole body goes to be where a far target is. */
function rootShift(
  places: readonly Vec[][],
  wanted: readonly Target[],
  windows: readonly (readonly [number, number])[],
): Vec[] {
  const need: Vec[] = places.map(() => [0, 0, 0]);
  for (const { joint, places: to, asked } of wanted) {
    const [base, length] = chain(joint);
    to.forEach((at, f) => {
      const [x, , z] = minus(at, places[f]![base]!);
      const line = masked([x, at[1] - places[f]![base]![1], z], asked[f]!);
      const share = Math.max(1 - (EASY * length) / Math.max(norm(line), 1e-9), 0);
      const beyond: Vec = [line[0] * share, 0, line[2] * share];
      const far = scaled(beyond, Math.min(1, WALK / Math.max(norm(beyond), 1e-9)));
      if (norm(far) > norm(need[f]!)) need[f] = far;
    });
  }
  const shift: Vec[] = places.map(() => [0, 0, 0]);
  for (const [start, stop] of windows) {
    const square = need.slice(start, stop).map((one) => (norm(one) > 0 ? (LARGE / 0.02) ** 2 : 0));
    const bands = bending(SLOW, stop - start, start > 0, stop < places.length);
    const [x, z] = [0, 2].map((k) => {
      const right = Float64Array.from(square, (one, f) => one * need[start + f]![k]!);
      return banded(
        square.map((one) => Float64Array.of(one)),
        right,
        bands,
        1,
      );
    });
    for (let f = start; f < stop; f += 1) shift[f] = [x![f - start]!, 0, z![f - start]!];
  }
  return shift;
}

/** Where the feet go when the body goes by `shift`; one of whose leg something is asked is free around then. */
function feetOf(places: readonly Vec[][], shift: readonly Vec[], targets: readonly Target[], fps: number): Weighted[] {
  const planted = plantedFeet(places, fps, null);
  return [LEFT, RIGHT].flatMap((side, n) => {
    const moved = carried(
      shift,
      planted.map((flags) => flags[2 * n]! || flags[2 * n + 1]!),
    );
    const own = targets.filter(({ joint }) => [side.knee, side.ankle, side.foot].includes(joint));
    const free = near(
      places.map((_, f) => own.some((one) => hasTarget(one.asked[f]!))),
      6,
    );
    return [2 * n, 2 * n + 1].map((k) => {
      const weights = planted.map((flags, f): Vec => {
        const weight = free[f] ? 1e-3 / SWINGING : 1 / (flags[k] ? STANDING : SWINGING);
        return [weight, weight, weight];
      });
      return { joint: FEET[k]!, places: places.map((at, f) => add(at[FEET[k]!]!, moved[f]!)), weights };
    });
  });
}

/** A stretch of frames, and the change of it: root, turns of `BALLS` in the parent's frame, bends of `HINGES`. */
class Pose {
  /** (frames, columns) in units of `SIZES`. */
  change: Float64Array;

  constructor(
    private readonly root: readonly Vec[],
    private readonly turns: readonly Turn[][],
  ) {
    this.change = new Float64Array(root.length * COLUMNS);
  }

  get frames(): number {
    return this.root.length;
  }

  private amount(f: number, column: number): number {
    return this.change[f * COLUMNS + column]! * SIZES[column]!;
  }

  private ball(f: number, n: number): Vec {
    return [0, 1, 2].map((k) => this.amount(f, 3 + 3 * n + k)) as unknown as Vec;
  }

  posed(f: number): [Vec, Turn[]] {
    const turns = [...this.turns[f]!];
    BALLS.forEach(([joint], n) => (turns[joint] = times(ofVector(this.ball(f, n)), turns[joint]!)));
    HINGES.forEach(({ middle, hinge }, n) => {
      turns[middle] = times(turns[middle]!, aboutAxis(hinge, this.amount(f, FIRST_HINGE + n)));
    });
    return [add(this.root[f]!, [0, 1, 2].map((k) => this.amount(f, k)) as unknown as Vec), turns];
  }

  /** Places and turns in the world. */
  pose(f: number): { places: Vec[]; world: Turn[] } {
    const [root, turns] = this.posed(f);
    const [places, world]: [Vec[], Turn[]] = [[root], [turns[0]!]];
    for (let joint = 1; joint < PARENTS.length; joint += 1) {
      const parent = PARENTS[joint]!;
      world.push(times(world[parent]!, turns[joint]!));
      places.push(add(places[parent]!, rotate(world[parent]!, REST[joint]!)));
    }
    return { places, world };
  }

  /** World turn of what hangs on the joint, per unit of each column behind the root's. */
  axes(f: number, world: readonly Turn[]): Vec[] {
    const balls = BALLS.flatMap(([joint, size], n) => {
      const frame = joint ? world[PARENTS[joint]!]! : IDENTITY;
      return perChange(this.ball(f, n)).map((axis) => scaled(rotate(frame, axis), size));
    });
    return [...balls, ...HINGES.map(({ middle, hinge, size }) => scaled(rotate(world[middle]!, hinge), size))];
  }
}

/** The turn of a rotation vector. */
function ofVector(v: Vec): Turn {
  const angle = norm(v);
  return angle > 0 ? aboutAxis(scaled(v, 1 / angle), angle) : IDENTITY;
}

/** World turn per change of each number of a rotation vector (Sola et al. 2018, eq. 145). */
function perChange(v: Vec): Vec[] {
  const angle = norm(v);
  const first = angle < 1e-4 ? 0.5 : (1 - Math.cos(angle)) / angle ** 2;
  const second = angle < 1e-4 ? 1 / 6 : (angle - Math.sin(angle)) / angle ** 3;
  return (
    [
      [1, 0, 0],
      [0, 1, 0],
      [0, 0, 1],
    ] as Vec[]
  ).map((axis) => {
    const once = cross(v, axis);
    return add(add(axis, once, first), cross(v, once), second);
  });
}

/** Radians by which knees and elbows are bent. */
function bends({ places, world }: { places: readonly Vec[]; world: readonly Turn[] }): number[] {
  return HINGES.map(({ start, middle, end, hinge }) => {
    const [upper, lower] = [minus(places[middle]!, places[start]!), minus(places[end]!, places[middle]!)];
    return Math.atan2(dot(rotate(world[middle]!, hinge), cross(upper, lower)), dot(upper, lower));
  });
}

/** Change a pose until it meets the targets best. */
function solve(pose: Pose, goal: readonly Weighted[], feet: readonly Weighted[], bands: readonly Float64Array[]): void {
  const targets = [...goal, ...feet];
  const begun = pose.change;
  pose.change = new Float64Array(begun.length);
  const limits = Array.from({ length: pose.frames }, (_, f) =>
    bends(pose.pose(f)).map((bent, n) => {
      const { size } = HINGES[n]!;
      return [(Math.min(bent, BEND[0]) - bent) / size, (Math.max(bent, BEND[1]) - bent) / size] as const;
    }),
  );
  pose.change = begun;
  let [damping, best, cost, last] = [1e-3, pose.change, Infinity, Infinity];
  for (let step = 0; step < STEPS; step += 1) {
    const seen = Array.from({ length: pose.frames }, (_, f) => pose.pose(f));
    const [now, off] = costOf(pose, seen, targets, goal.length, bands);
    if (now > cost) {
      damping *= 10;
      pose.change = pose.change.map((x, n) => (x + best[n]!) / 2);
      if (damping > 1e3) break;
      continue;
    }
    const done = cost - now < 1e-3 * now && Math.abs(last - off) < DONE;
    [best, cost, last, damping] = [pose.change, now, off, damping / 3];
    if (done) break;
    const change = banded(...normal(pose, seen, targets, damping), bands, COLUMNS);
    const most = change.reduce((size, x, n) => Math.max(size, Math.abs(x - best[n]!)), 1e-9);
    const share = Math.min(1, 1.5 / most);
    pose.change = change.map((x, n) => {
      const [f, column] = [Math.floor(n / COLUMNS), n % COLUMNS];
      const next = best[n]! + share * (x - best[n]!);
      return column < FIRST_HINGE ? next : clip(next, ...limits[f]![column - FIRST_HINGE]!);
    });
  }
  pose.change = best;
}

type Posed = { places: Vec[]; world: Turn[] };

/** What is minimised, and metres that the first `count` targets are off at most. */
function costOf(
  pose: Pose,
  seen: readonly Posed[],
  targets: readonly Weighted[],
  count: number,
  bands: readonly Float64Array[],
): [number, number] {
  const { change } = pose;
  let total = change.reduce((sum, x) => sum + x * x, 0);
  for (let k = 0; k < 3; k += 1) {
    for (let n = 0; n + k * COLUMNS < change.length; n += 1) {
      const both = change[n]! * change[n + k * COLUMNS]!;
      total += (k ? 2 : 1) * bands[k]![Math.floor(n / COLUMNS)]! * both;
    }
  }
  let far = 0;
  targets.forEach(({ joint, places, weights }, n) =>
    seen.forEach((at, f) => {
      const [error, weight] = [minus(places[f]!, at.places[joint]!), weights[f]!];
      total += error.reduce((sum, x, k) => sum + (x * weight[k]!) ** 2, 0);
      if (n < count) far = Math.max(far, ...error.map((x, k) => (weight[k] ? Math.abs(x) : 0)));
    }),
  );
  return [total, far];
}

/** The blocks and right side of the normal equations, frame by frame. */
function normal(
  pose: Pose,
  seen: readonly Posed[],
  targets: readonly Weighted[],
  damping: number,
): [Float64Array[], Float64Array] {
  const right = pose.change.map((x) => damping * x);
  const blocks = seen.map(({ places, world }, f) => {
    const block = new Float64Array(COLUMNS * COLUMNS);
    for (let n = 0; n < COLUMNS; n += 1) block[n * COLUMNS + n] = damping;
    const axes = pose.axes(f, world);
    for (const { joint, places: to, weights } of targets) {
      const moves = MOVED_BY[joint]!.map(([column, pivot]) => {
        return [column, cross(axes[column - 3]!, minus(places[joint]!, places[pivot]!))] as const;
      });
      const error = minus(to[f]!, places[joint]!);
      for (let k = 0; k < 3; k += 1) {
        const square = weights[f]![k]! ** 2;
        if (!square) continue;
        const row: (readonly [number, number])[] = [[k, ROOT], ...moves.map(([n, way]) => [n, way[k]!] as const)];
        const ahead = row.reduce((sum, [n, x]) => sum + x * pose.change[f * COLUMNS + n]!, error[k]!);
        for (const [n, x] of row) {
          right[f * COLUMNS + n]! += square * x * ahead;
          for (const [m, y] of row) block[n * COLUMNS + m]! += square * x * y;
        }
      }
    }
    return block;
  });
  return [blocks, right];
}
