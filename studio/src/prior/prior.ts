/**
 * Sentences to motion, as `motionloom generate --literal` and `motionloom compose` draw it: takes of one sentence, or a
 * chain of several whose ends overlap, along a path on the ground if there is one.
 */

import { bodyOf } from "./body";
import { type GroundPose, ORIGIN, WIDTH, contacts, decoded, smooth } from "./features";
import { cleanFeet } from "./feet";
import { Noise } from "./noise";
import type { Condition, Network } from "./network";
import type { Body } from "./person";
import { type Place, type Way, seenFrom, startOf, wayThrough } from "./path";
import { cosine, guidanceAt, levels, move } from "./schedule";
import { supported } from "./stairs";
import { Steering } from "./steering";
import { type Vec, rounded } from "./turns";
import { type Part, TRANSITION } from "./amounts";

export interface Segment {
  readonly text: string;
  readonly seconds: number;
}

/** Sentences as parts without numbers: they share a second where they meet. */
export const literal = (segments: readonly Segment[]): Part[] =>
  segments.map(({ text, seconds }) => ({ text, seconds, transition: TRANSITION, way: null }));

/** Called behind each network call with the denoised features of each take; a rejection ends the drawing. */
export type Watcher = (done: number, of: number, takes: () => Float32Array[]) => Promise<void>;

export class Prior {
  private readonly mean: Float32Array;
  private readonly std: Float32Array;

  constructor(readonly network: Network) {
    this.mean = network.packed.tensor("mean");
    this.std = network.packed.tensor("std");
  }

  get fps(): number {
    return this.network.packed.about.fps;
  }

  /**
   * Features (frames * 263) of each take; take i is sampled from `seed + i`. With a way the pelvis keeps to it, and the
   * features begin at `startOf` it.
   */
  async features(
    segments: readonly Part[],
    seed: number | bigint,
    takes: number,
    watch?: Watcher,
    way?: Way | null,
  ): Promise<Float32Array[]> {
    return segments.length === 1
      ? this.single(segments[0]!, seed, takes, watch, way ?? null)
      : this.chain(segments, seed, takes, watch, way ?? null);
  }

  /** The way through points on the ground (x, z in metres) for as long as segments last; an Error for one too long. */
  way(segments: readonly Segment[], points: readonly Place[]): Way {
    const each = segments.map(({ seconds }) =>
      segments.length > 1 ? rounded(seconds * this.fps) : this.frames(seconds),
    );
    return wayThrough(
      points,
      each.reduce((sum, one) => sum + one, 0),
      this.fps,
    );
  }

  /**
   * The person that features of parts are: with constant bones and still feet, on `way` if there is one. Where nobody says
   * where to go, steps are under who climbs, and the floor under who hovers.
   */
  person(features: ArrayLike<number>, parts: readonly Part[], way: Way | null): Body {
    const body = finished(features, this.fps, way ? startOf(way) : ORIGIN);
    return way || (parts.length === 1 && parts[0]!.way) ? body : supported(body);
  }

  /** Frames of a motion of so many seconds. */
  frames(seconds: number): number {
    return Math.max(rounded(seconds * this.fps), 4);
  }

  private async single(
    { text, seconds, way: own }: Part,
    seed: number | bigint,
    takes: number,
    watch: Watcher | undefined,
    way: Way | null,
  ): Promise<Float32Array[]> {
    const [asked, frames] = [await this.network.ask(text), this.frames(seconds)];
    const steering = way ? this.steering(seenFrom(way, startOf(way)), frames, 0) : own && this.steering(own, frames, 0);
    const rows = Array.from(
      { length: takes },
      (_, n) => new Link(frames, 0, 0, asked, BigInt(seed) + BigInt(n), steering),
    );
    return await this.walk(rows, false, watch, (states) => states.map((state) => smooth(this.plain(state))));
  }

  private async chain(
    segments: readonly Part[],
    seed: number | bigint,
    takes: number,
    watch: Watcher | undefined,
    way: Way | null,
  ): Promise<Float32Array[]> {
    const seams = segments.map(({ transition }, n) =>
      n < segments.length - 1 ? Math.max(1, rounded((transition * this.fps) / 2)) : 0,
    );
    const asked = await Promise.all(segments.map(({ text }) => this.network.ask(text)));
    const rows: Link[] = [];
    for (let take = 0; take < takes; take += 1) {
      let first = 0;
      segments.forEach(({ text, seconds, way: wanted }, n) => {
        const [before, after, frames] = [seams[n - 1] ?? 0, seams[n]!, rounded(seconds * this.fps)];
        if (frames < before + after || frames < 2)
          throw new Error(
            `"${text.slice(0, 40)}" of ${seconds} s is shorter than half its transitions; make it longer`,
          );
        const length = before + frames + after;
        const part = way ? seenFrom(way, poseOn(way, first), first, first + frames) : wanted;
        const own = part && this.steering(part, length, before);
        rows.push(new Link(length, before, after, asked[n]!, BigInt(seed) + BigInt(take + n), own));
        first += frames;
      });
    }
    const cut = (states: readonly Float32Array[]): Float32Array[] =>
      Array.from({ length: takes }, (_, take) => {
        const pieces = segments.map((__, n) => {
          const [row, state] = [rows[take * segments.length + n]!, states[take * segments.length + n]!];
          return state.subarray(row.before * WIDTH, (row.length - row.after) * WIDTH);
        });
        return joined(way ? this.onWay(pieces, way) : pieces.map((piece) => this.plain(piece)));
      });
    return this.walk(rows, true, watch, cut);
  }

  /** Pieces of a chain, each bent once more to its part of the way, so that errors do not add up. */
  private onWay(pieces: readonly Float32Array[], way: Way): Float32Array[] {
    let [pose, first] = [startOf(way), 0];
    return pieces.map((piece) => {
      const frames = piece.length / WIDTH;
      const own = this.steering(seenFrom(way, pose, first, first + frames), frames, 0);
      const features = this.plain(own.correct(piece, 0));
      [pose, first] = [decoded(features, pose).end, first + frames];
      return features;
    });
  }

  private steering(way: Way, frames: number, first: number): Steering {
    return new Steering(way, frames, first, this.mean, this.std);
  }

  /** Rows from noise to clean states; the ends of a chain's rows are kept alike at every level. */
  private async walk(
    rows: readonly Link[],
    average: boolean,
    watch: Watcher | undefined,
    finish: (states: readonly Float32Array[]) => Float32Array[],
  ): Promise<Float32Array[]> {
    const { schedule, sampling } = this.network.packed.about;
    const [table, way] = [cosine(schedule.steps), levels(schedule.steps, sampling.steps)];
    let states = noiseOf(rows);
    for (let n = 0; n + 1 < way.length; n += 1) {
      const [t, s] = [way[n]!, way[n + 1]!];
      const last = n + 2 === way.length;
      const free = average && last ? await this.averaged(rows, states, t) : await this.estimated(rows, states, t);
      const clean = free.map((one, r) => rows[r]!.steering?.correct(one, table.noise[t]!) ?? one);
      const [ofClean, ofState, ofNoise] = move(table, t, s);
      const fresh = noiseOf(rows);
      states = states.map((state, r) =>
        state.map((x, k) => ofClean * clean[r]![k]! + ofState * x + ofNoise * fresh[r]![k]!),
      );
      shake(rows, states);
      await watch?.(n + 1, way.length - 1, () => finish(clean));
    }
    return finish(states);
  }

  private estimated(rows: readonly Link[], states: readonly Float32Array[], level: number): Promise<Float32Array[]> {
    const asked = rows.map((row, r) => ({ state: states[r]!, level, asked: row.asked }));
    const { schedule, sampling } = this.network.packed.about;
    return this.network.guided(asked, guidanceAt(level, schedule.steps, sampling.guidance, sampling.late_guidance));
  }

  /** Averages over all ways to divide the frames into the network's tokens, so that none leaves small steps. */
  private async averaged(
    rows: readonly Link[],
    states: readonly Float32Array[],
    level: number,
  ): Promise<Float32Array[]> {
    const sums = await this.estimated(rows, states, level);
    const { patch } = this.network.packed.about.net;
    for (let shift = 1; shift < patch; shift += 1) {
      const parts = await this.estimated(
        rows,
        states.map((state) => state.slice(shift * WIDTH)),
        level,
      );
      parts.forEach((part, r) => part.forEach((x, k) => (sums[r]![k + shift * WIDTH]! += x)));
    }
    return sums.map((sum) => sum.map((x, k) => x / Math.min(Math.floor(k / WIDTH) + 1, patch)));
  }

  private plain(state: Float32Array): Float32Array {
    return state.map((x, n) => Math.fround(x * this.std[n % WIDTH]!) + this.mean[n % WIDTH]!);
  }
}

/** A row of a chain, or one alone: `before` and `after` are the halves of its transitions. */
class Link {
  private readonly noise: Noise;

  constructor(
    readonly length: number,
    readonly before: number,
    readonly after: number,
    readonly asked: Condition,
    seed: bigint,
    readonly steering: Steering | null,
  ) {
    this.noise = new Noise(seed);
  }

  normals(): Float32Array {
    return this.noise.normals(this.length * WIDTH);
  }
}

/** Noise of all rows; where two overlap both have that of the first one. */
function noiseOf(rows: readonly Link[]): Float32Array[] {
  const own = rows.map((row) => row.normals());
  return own.map((noise, r) => {
    const result = noise.slice();
    const shared = 2 * rows[r]!.before * WIDTH;
    if (shared) result.set(own[r - 1]!.subarray(own[r - 1]!.length - shared), 0);
    return result;
  });
}

/** Make the copies of each overlap equal, in place: the first row fades into the second. */
function shake(rows: readonly Link[], states: readonly Float32Array[]): void {
  rows.forEach(({ before }, r) => {
    const overlap = 2 * before;
    if (!overlap) return;
    const [second, end] = [states[r]!, states[r - 1]!];
    const first = end.subarray(end.length - overlap * WIDTH);
    first.forEach((x, k) => {
      const share = Math.floor(k / WIDTH) / overlap;
      first[k] = second[k] = x + share * (second[k]! - x);
    });
  });
}

function joined(parts: readonly Float32Array[]): Float32Array {
  const all = new Float32Array(parts.reduce((sum, part) => sum + part.length, 0));
  parts.reduce((at, part) => {
    all.set(part, at);
    return at + part.length;
  }, 0);
  return all;
}

/** Where somebody on a way is in a frame, and faces. */
function poseOn(way: Way, frame: number): GroundPose {
  const [x, z] = way.places[frame]!;
  return { x, z, facing: way.facing?.[frame] ?? 0 };
}

/** Features to a person with constant bones and still feet; `begin`: the origin facing +Z, or `startOf` a way. */
export function finished(features: ArrayLike<number>, fps: number, begin = ORIGIN): Body {
  return cleanFeet(bodyOf(decoded(features, begin).places, fps), contacts(features));
}

/** Places that the network predicted, whose bones may breathe, (frames * 22 * 3) metres. */
export function sketched(features: ArrayLike<number>, begin = ORIGIN): Float32Array {
  return flat(decoded(features, begin).places);
}

export function flat(places: readonly (readonly Vec[])[]): Float32Array {
  return Float32Array.from(places.flat(2));
}
