/** A path on the ground through points, walked at even speed (`motionloom.goals.paths`). */

import { sums, unwrapAngles } from "./dense";
import type { GroundPose } from "./features";
import { clip } from "./turns";

/** Metres: x and z in the world. */
export type Place = readonly [number, number];

/** Where the pelvis is on the ground in each frame, and the way it faces there; null: nobody asks. */
export interface Way {
  readonly places: readonly Place[];
  readonly facing: readonly number[] | null;
  /** Whether the places are nobody's concern, and only the facing is. */
  readonly free?: boolean;
}

/** Metres per second: nobody runs faster. */
export const FASTEST = 12;
/** Metres per second below which a path has no direction of its own. */
const STANDING = 0.02;
/** Frames on either side over which the facing along a path is averaged. */
const TURNING = 5;
/** Straight pieces per stretch of a smooth curve. */
const FINE = 32;

/** The way through points, for a motion of so many frames. */
export function wayThrough(points: readonly Place[], frames: number, fps: number): Way {
  const length = lengths(points).at(-1)!;
  const seconds = (frames - 1) / fps;
  if (length > FASTEST * seconds)
    throw new Error(
      `the path is ${length.toFixed(1)} m long, and nobody runs that far in ${seconds.toFixed(1)} s; make it shorter or the sentences longer`,
    );
  const places = even(
    points,
    Array.from({ length: frames }, (_, f) => f / (frames - 1)),
  );
  const wide = [0, 1].some((k) => Math.max(...places.map((at) => Math.abs(at[k]! - places[0]![k]!))) >= 1e-3);
  return { places, facing: wide ? along(places, fps) : null };
}

/** Where somebody on a way is at its beginning. */
export function startOf({ places, facing }: Way): GroundPose {
  return { x: places[0]![0], z: places[0]![1], facing: facing?.[0] ?? 0 };
}

/** Some frames of a way, in coordinates in which a pose is the origin and faces +Z. */
export function seenFrom(way: Way, pose: GroundPose, first = 0, last = way.places.length): Way {
  const [c, s] = [Math.cos(pose.facing), Math.sin(pose.facing)];
  return {
    ...way,
    places: way.places.slice(first, last).map(([px, pz]) => {
      const [x, z] = [px - pose.x, pz - pose.z];
      return [c * x - s * z, c * z + s * x];
    }),
    facing: way.facing?.slice(first, last).map((angle) => angle - pose.facing) ?? null,
  };
}

/** Places at shares (0 to 1) of the length of the smooth curve through points. */
export function even(points: readonly Place[], shares: readonly number[]): Place[] {
  let line = points.filter((at, n) => !n || apart(at, points[n - 1]!) > 0);
  if (line.length === 1) return shares.map(() => line[0]!);
  if (line.length > 2) {
    const chord = lengths(line);
    const at = chord.slice(1).flatMap((end, n) => {
      const begin = chord[n]!;
      return Array.from({ length: FINE }, (_, k) => begin + (k * (end - begin)) / FINE);
    });
    line = through(line, chord, [...at, chord.at(-1)!]);
  }
  const length = lengths(line);
  let piece = 0;
  return shares.map((share) => {
    const at = share * length.at(-1)!;
    while (piece < line.length - 2 && length[piece + 1]! <= at) piece += 1;
    const span = length[piece + 1]! - length[piece]!;
    return mixed(line[piece]!, line[piece + 1]!, span > 0 ? clip((at - length[piece]!) / span, 0, 1) : 1);
  });
}

const apart = (a: Place, b: Place): number => Math.hypot(a[0] - b[0], a[1] - b[1]);
const mixed = (a: Place, b: Place, u: number): Place => [a[0] + u * (b[0] - a[0]), a[1] + u * (b[1] - a[1])];
const lengths = (points: readonly Place[]): number[] => sums(points.slice(1).map((at, n) => apart(at, points[n]!)));

/** Points reached at rising times to the places between them: Hermite pieces that do not overshoot. */
function through(points: readonly Place[], times: readonly number[], at: readonly number[]): Place[] {
  const span = times.slice(1).map((end, n) => end - times[n]!);
  const velocity = span.map((one, n): Place => [0, 1].map((k) => (points[n + 1]![k]! - points[n]![k]!) / one) as never);
  const tangent = tangents(velocity, span, points.length > 3 && apart(points[0]!, points.at(-1)!) === 0);
  let piece = 0;
  return at.map((time) => {
    while (piece < span.length - 1 && times[piece + 1]! <= time) piece += 1;
    const h = span[piece]!;
    const u = clip((time - times[piece]!) / h, 0, 1);
    const [start, leaving] = [2 * u ** 3 - 3 * u ** 2 + 1, u ** 3 - 2 * u ** 2 + u];
    const [end, coming] = [3 * u ** 2 - 2 * u ** 3, u ** 3 - u ** 2];
    const on = (k: 0 | 1): number =>
      start * points[piece]![k] +
      leaving * h * tangent[piece]![k] +
      end * points[piece + 1]![k] +
      coming * h * tangent[piece + 1]![k];
    return [on(0), on(1)];
  });
}

/** Velocities of pieces to those at their ends (Fritsch and Carlson 1980, carried to vectors). */
function tangents(velocity: readonly Place[], span: readonly number[], closed: boolean): Place[] {
  const last = velocity.length - 1;
  return Array.from({ length: velocity.length + 1 }, (_, n): Place => {
    const [a, b] = [n ? n - 1 : closed ? last : 0, n <= last ? n : closed ? 0 : last];
    const [before, after, past, coming] = [velocity[a]!, velocity[b]!, span[a]!, span[b]!];
    const mean = [0, 1].map((k) => (before[k]! * coming + after[k]! * past) / (past + coming)) as [number, number];
    const [one, other] = [Math.hypot(...before), Math.hypot(...after)];
    const [slow, fast] = [Math.min(one, other), Math.max(one, other)];
    const cosine = (before[0] * after[0] + before[1] * after[1]) / Math.max(slow * fast, 1e-300);
    const limit = 3 * slow * (1 + Math.min(cosine, 0));
    const share = Math.min(1, limit / Math.max(Math.hypot(...mean), 1e-300));
    return [mean[0] * share, mean[1] * share];
  });
}

/** Radians about +Y, 0 along +Z: the way that places per frame go, turned evenly while they stand still. */
export function along(places: readonly Place[], fps: number): number[] {
  const count = places.length;
  const steps = places.slice(1).map((at, n): Place => [at[0] - places[n]![0], at[1] - places[n]![1]]);
  const moving = [...steps.keys()].filter((n) => Math.hypot(...steps[n]!) * fps > STANDING);
  if (!moving.length) return places.map(() => 0);
  const angle = unwrapAngles(moving.map((n) => Math.atan2(...steps[n]!)));
  const turn = places.map((_, f) => between(f - 0.5, moving, angle));
  const [last, near] = [moving.length - 1, (a: number, b: number): boolean => Math.abs(angle[a]! - angle[b]!) < 0.3];
  if (last > 0 && moving[0] === 0 && moving[1] === 1 && near(0, 1)) turn[0] = angle[0]! - (angle[1]! - angle[0]!) / 2;
  if (last > 0 && moving[last - 1] === count - 3 && moving[last] === count - 2 && near(last, last - 1))
    turn[count - 1] = angle[last]! + (angle[last]! - angle[last - 1]!) / 2;
  const total = sums(turn);
  return places.map((_, f) => {
    const reach = Math.min(TURNING, f, count - 1 - f);
    return (total[f + reach + 1]! - total[f - reach]!) / (2 * reach + 1);
  });
}

/** Linear between values at rising places, constant beyond them. */
export function between(x: number, at: readonly number[], values: readonly number[]): number {
  const n = at.findIndex((one) => one > x);
  if (n <= 0) return n ? values.at(-1)! : values[0]!;
  return values[n - 1]! + ((x - at[n - 1]!) / (at[n]! - at[n - 1]!)) * (values[n]! - values[n - 1]!);
}
