/**
 * Each denoised estimate is bent, as little and as smoothly as it takes, to a path on the ground
 * (`motionloom.edits.steering`, the part of it that paths need).
 */

import { LEFT, RIGHT } from "../body/skeleton";
import { bell, product, solveSystem, sums, unwrapAngles } from "./dense";
import { CONTACTS, WIDTH } from "./features";
import type { Way } from "./path";
import { stilled } from "./stances";
import type { Vec } from "./turns";

/** Metres: how exactly the path is met. Radians: the same for the facing. */
const [EXACT, SQUARE] = [0.002, 0.02];
/** Standard deviations of the root's velocity (metres a frame), of the heading's (radians a frame), and of a last small part. */
const [PACE, YAW, STILL] = [0.015, 0.03, 0.003];
/** Frames over which a change is spread, from noises of the schedule above the first number of each pair. */
const WIDTHS = [
  [0.9, 12],
  [0.5, 8],
  [0, 5],
] as const;
/** Frames over which the body turns with its path; metres a frame below which a path has no direction. */
const [TURN_OVER, SLOW] = [6, 0.01];

/** Where the displacements of the joints begin in a frame's numbers. */
const VELOCITY = 193;

interface Plan {
  /** (frames + 1, asked): changes from what is asked of the place, of the facing, and of the place at last. */
  readonly move: Float64Array;
  readonly turn: Float64Array;
  readonly rest: Float64Array;
}

/** An estimate in the frame of the way. */
interface Estimate {
  /** (frames + 1) radians, x and z metres; 0 at the way's first frame. */
  readonly facing: readonly number[];
  readonly x: readonly number[];
  readonly z: readonly number[];
}

export class Steering {
  private readonly plans = new Map<number, Plan>();

  /** `way` as the row's root sees it at row frame `first`, where it begins; of a row of so many frames. */
  constructor(
    private readonly way: Way,
    private readonly frames: number,
    private readonly first: number,
    private readonly mean: Float32Array,
    private readonly std: Float32Array,
  ) {}

  /** A standardised estimate (frames * 263) whose root keeps to the way; `noise` is its level's share of noise. */
  correct(denoised: Float32Array, noise: number): Float32Array {
    const width = WIDTHS.find(([least]) => noise >= least)![1];
    const plan = this.plans.get(width) ?? this.plan(width);
    this.plans.set(width, plan);
    const features = Float64Array.from(denoised, (x, n) => x * this.std[n % WIDTH]! + this.mean[n % WIDTH]!);
    const changed = this.bent(features, plan);
    return denoised.map((x, n) => x + (changed[n]! - features[n]!) / this.std[n % WIDTH]!);
  }

  private get asked(): number {
    return Math.min(this.way.places.length, this.frames - this.first);
  }

  private plan(width: number): Plan {
    const pace = summed(bell(this.frames, width), this.frames, this.first);
    const gain = (size: number, noise: number): Float64Array => this.gain(pace, size * size, noise * noise);
    const none = new Float64Array();
    return {
      move: this.way.free ? none : gain(PACE, EXACT),
      turn: this.way.facing ? gain(YAW, SQUARE) : none,
      rest: this.way.free ? none : gain(STILL, EXACT),
    };
  }

  /** (frames + 1, asked): the posterior mean of what has this covariance from what is seen of it. */
  private gain(pace: Float64Array, scale: number, noise: number): Float64Array {
    const [size, count] = [this.frames + 1, this.asked];
    const inner = new Float64Array(count * count);
    const outer = new Float64Array(count * size);
    for (let i = 0; i < count; i += 1) {
      for (let j = 0; j < count; j += 1)
        inner[i * count + j] = scale * pace[(i + this.first) * size + j + this.first]! + (i === j ? noise : 0);
      for (let j = 0; j < size; j += 1) outer[i * size + j] = scale * pace[(i + this.first) * size + j]!;
    }
    const found = solveSystem(inner, outer, count, size);
    return Float64Array.from({ length: size * count }, (_, n) => found[(n % count) * size + Math.floor(n / count)]!);
  }

  private bent(features: Float64Array, plan: Plan): Float64Array {
    const old = decoded(features, this.first);
    let now = this.toPath(old, plan.move);
    const turned = turningWith(old, now, this.first);
    now = { ...now, facing: now.facing.map((angle, f) => angle + turned[f]!) };
    const { facing } = this.way;
    if (facing) {
      const ahead = headings(features, now.facing);
      const error = unwrapAngles(facing.slice(0, this.asked).map((angle, n) => half(angle - ahead[n + this.first]!)));
      const change = product(plan.turn, error);
      now = { ...now, facing: now.facing.map((angle, f) => angle + change[f]!) };
    }
    return encoded(features, this.toPath(now, plan.rest));
  }

  /** The estimate with its root nearer to the way. */
  private toPath(now: Estimate, gain: Float64Array): Estimate {
    if (this.way.free) return now;
    const places = this.way.places.slice(0, this.asked);
    const dx = product(
      gain,
      places.map(([x], n) => x - now.x[n + this.first]!),
    );
    const dz = product(
      gain,
      places.map(([, z], n) => z - now.z[n + this.first]!),
    );
    return { facing: now.facing, x: now.x.map((x, f) => x + dx[f]!), z: now.z.map((z, f) => z + dz[f]!) };
  }
}

/** The angle the short way. */
const half = (angle: number): number => angle - 2 * Math.PI * Math.floor((angle + Math.PI) / (2 * Math.PI));

/** (frames + 1, frames + 1): the covariance of what a velocity (frames, frames) adds up to from frame `first` on. */
function summed(velocity: Float64Array, frames: number, first: number): Float64Array {
  const size = frames + 1;
  const total = new Float64Array(size * size);
  for (let i = 1; i < size; i += 1) {
    let row = 0;
    for (let j = 1; j < size; j += 1) {
      row += velocity[(i - 1) * frames + j - 1]!;
      total[i * size + j] = total[(i - 1) * size + j]! + row;
    }
  }
  const middle = total[first * size + first]!;
  return total.map((x, n) => {
    const [i, j] = [Math.floor(n / size), n % size];
    return x - total[first * size + j]! - total[i * size + first]! + middle;
  });
}

function decoded(features: Float64Array, first: number): Estimate {
  const frames = features.length / WIDTH;
  const row = (f: number, n: number): number => features[f * WIDTH + n]!;
  const all = Array.from({ length: frames }, (_, f) => f);
  const turns = sums(all.map((f) => row(f, 0)));
  const facing = turns.map((sum) => -2 * (sum - turns[first]!));
  const step = (f: number, sideways: number, ahead: number): number =>
    Math.cos(facing[f + 1]!) * row(f, sideways) + Math.sin(facing[f + 1]!) * ahead;
  const x = sums(all.map((f) => step(f, 1, row(f, 2))));
  const z = sums(all.map((f) => step(f, 2, -row(f, 1))));
  return { facing, x: x.map((at) => at - x[first]!), z: z.map((at) => at - z[first]!) };
}

/** A joint's place in a frame, in the heading frame, x and z from the root. */
function local(features: Float64Array, f: number, joint: number): Vec {
  const at = f * WIDTH + 1 + 3 * joint;
  return joint ? [features[at]!, features[at + 1]!, features[at + 2]!] : [0, features[f * WIDTH + 3]!, 0];
}

function turned([x, y, z]: Vec, angle: number): Vec {
  const [c, s] = [Math.cos(angle), Math.sin(angle)];
  return [c * x + s * z, y, c * z - s * x];
}

/** Radians per frame: where hips and shoulders face. */
function headings(features: Float64Array, facing: readonly number[]): number[] {
  return Array.from({ length: features.length / WIDTH }, (_, f) => {
    const at = (joint: number): Vec => turned(local(features, f, joint), facing[f]!);
    const [a, b, c, d] = [at(LEFT.hip), at(RIGHT.hip), at(LEFT.shoulder), at(RIGHT.shoulder)];
    return Math.atan2(-(a[2] - b[2] + c[2] - d[2]), a[0] - b[0] + c[0] - d[0]);
  });
}

/** Radians by which the way turned where the path changed: the body turns with it. */
function turningWith(old: Estimate, now: Estimate, first: number): number[] {
  const count = old.x.length;
  const way = ({ x, z }: Estimate): [number, number][] =>
    x.map((_, f) => {
      const n = Math.min(f, count - 2);
      return [z[n + 1]! - z[n]!, x[n + 1]! - x[n]!];
    });
  const [before, after] = [way(old), way(now)];
  const kernel = bell(count, TURN_OVER);
  const weight = product(kernel, new Array<number>(count).fill(1));
  const real = product(
    kernel,
    after.map(([a, b], f) => a * before[f]![0] + b * before[f]![1]),
  );
  const imaginary = product(
    kernel,
    after.map(([a, b], f) => b * before[f]![0] - a * before[f]![1]),
  );
  const angle = unwrapAngles(real.map((x, f) => Math.atan2(imaginary[f]!, x + weight[f]! * SLOW ** 2)));
  const whole = 2 * Math.PI * Math.round(angle[first]! / (2 * Math.PI));
  return angle.map((one, f) => (one - whole) * (1 - Math.exp(-0.5 * ((f - first) / TURN_OVER) ** 2)));
}

/** The old features with another root, with legs whose feet stand where the contacts say so. */
function encoded(old: Float64Array, { facing, x, z }: Estimate): Float64Array {
  const frames = old.length / WIDTH;
  const result = old.slice();
  const world = (f: number, joint: number): Vec => {
    const [px, py, pz] = turned(local(old, f, joint), facing[f]!);
    return [px + x[f]!, py, pz + z[f]!];
  };
  for (let f = 0; f < frames; f += 1) {
    const [dx, , dz] = turned([x[f + 1]! - x[f]!, 0, z[f + 1]! - z[f]!], -facing[f + 1]!);
    result.set([-(facing[f + 1]! - facing[f]!) / 2, dx, dz], f * WIDTH);
  }
  [LEFT, RIGHT].forEach(({ knee, ankle, foot }, side) => {
    const flag = (f: number, k: number): boolean => old[f * WIDTH + CONTACTS + 2 * side + k]! > 0.5;
    const all = Array.from({ length: frames }, (_, f) => f);
    const still = stilled(
      all.map((f) => world(f, ankle)),
      all.map((f) => world(f, foot)),
      all.map((f) => [flag(f, 0), flag(f, 1)] as const),
    );
    still.forEach((step, f) => {
      const [dx, , dz] = turned(step, -facing[f]!);
      for (const [joint, share] of [[knee, 0.5] as const, [ankle, 1] as const, [foot, 1] as const]) {
        result[f * WIDTH + 1 + 3 * joint]! += share * dx;
        result[f * WIDTH + 3 + 3 * joint]! += share * dz;
      }
    });
  });
  for (let f = 0; f + 1 < frames; f += 1) {
    for (let joint = 0; joint < 22; joint += 1) {
      const [a, b] = [displacement(old, f, joint), displacement(result, f, joint)];
      for (let k = 0; k < 3; k += 1) result[f * WIDTH + VELOCITY + 3 * joint + k]! += b[k]! - a[k]!;
    }
  }
  return result;
}

/** How far a joint goes to the next frame, in the heading frame. */
function displacement(features: Float64Array, f: number, joint: number): Vec {
  const [now, next] = [local(features, f, joint), local(features, f + 1, joint)];
  const row = f * WIDTH;
  const [x, y, z] = turned([next[0] + features[row + 1]!, next[1], next[2] + features[row + 2]!], -2 * features[row]!);
  return [x - now[0], y - now[1], z - now[2]];
}
