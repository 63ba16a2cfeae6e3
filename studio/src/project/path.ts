/** A path on the floor: drawn points, and where somebody is on it at which time. */

import { type Path, type PathPoint, type Vec3, clamp, round } from "./model";

export interface Ground {
  readonly x: number;
  readonly z: number;
}

/** A path with a time for every point; where somebody stays, a point is there twice. */
export interface TimedPath {
  readonly points: readonly Ground[];
  readonly times: readonly number[];
  readonly facing: readonly (number | null)[];
  /** Metres per second between stops. */
  readonly speed: number;
  /** The asked speed would have taken longer than there is time. */
  readonly hurried: boolean;
}

const SHORTEST_STEP = 0.05;

export function pathPoint(x: number, z: number): PathPoint {
  return { x: round(x), z: round(z), stop: 0, facing: null };
}

export function pathLength(points: readonly Ground[]): number {
  let sum = 0;
  for (let n = 1; n < points.length; n += 1) sum += apart(points[n - 1]!, points[n]!);
  return sum;
}

export function apart(a: Ground, b: Ground): number {
  return Math.hypot(a.x - b.x, a.z - b.z);
}

/** When each point is reached within `seconds`, which it fills: who arrives early stays. Null for fewer than two points. */
export function timed(path: Path, seconds: number): TimedPath | null {
  if (path.times) return walked(path, path.times, seconds);
  const points = withoutDoubles(path.points);
  const metres = pathLength(points);
  if (points.length < 2 || metres < SHORTEST_STEP) return null;
  const asked = points.reduce((sum, point) => sum + point.stop, 0);
  const squeeze = asked > seconds * 0.8 ? (seconds * 0.8) / asked : 1;
  const walking = seconds - asked * squeeze;
  const hurried = path.speed !== null && metres / path.speed > walking + 1e-6;
  const speed = path.speed === null || hurried ? metres / walking : path.speed;

  const stages: Stage[] = [];
  let time = 0;
  points.forEach((point, index) => {
    if (index > 0) time += apart(points[index - 1]!, point) / speed;
    stages.push({ point, time });
    if (point.stop > 0) stages.push({ point, time: (time += point.stop * squeeze) });
  });
  return { ...filling(stages, seconds), speed, hurried };
}

interface Stage {
  readonly point: PathPoint;
  readonly time: number;
}

/** A way with times of its own. */
function walked(path: Path, times: readonly number[], seconds: number): TimedPath | null {
  const stages = path.points
    .map((point, index) => ({ point, time: times[index]! }))
    .filter(({ time }) => time <= seconds);
  if (stages.length < 2) return null;
  return { ...filling(stages, seconds), speed: pathLength(stages.map(({ point }) => point)) / seconds, hurried: false };
}

function filling(stages: readonly Stage[], seconds: number): Pick<TimedPath, "points" | "times" | "facing"> {
  const last = stages.at(-1)!;
  const all = seconds - last.time > 0.02 ? [...stages, { point: last.point, time: seconds }] : stages;
  return {
    points: all.map(({ point: { x, z } }) => ({ x, z })),
    times: all.map(({ time }) => round(Math.min(time, seconds))),
    facing: all.map(({ point }) => point.facing),
  };
}

/** Degrees from one place to another; 0 is +Z, 90 is +X. */
export function direction(from: Ground, to: Ground): number {
  return (Math.atan2(to.x - from.x, to.z - from.z) * 180) / Math.PI;
}

/** The direction of the path at a point. */
export function along(points: readonly Ground[], index: number): number {
  const before = points[Math.max(index - 1, 0)]!;
  const after = points[Math.min(index + 1, points.length - 1)]!;
  return direction(before, after);
}

/** Degrees at every timed point, turning the short way; null where no point asks for a direction of its own. */
export function facings(path: TimedPath): number[] | null {
  if (path.facing.every((one) => one === null)) return null;
  const result: number[] = [];
  path.facing.forEach((asked, index) => {
    let degrees = asked ?? along(path.points, index);
    const last = result.at(-1);
    if (last !== undefined) degrees += Math.round((last - degrees) / 360) * 360;
    result.push(round(degrees));
  });
  return result;
}

/** A curve through the points, for the eye: `per` places between neighbours. */
export function curve(points: readonly Ground[], per = 12): Ground[] {
  if (points.length < 2) return [...points];
  const result: Ground[] = [];
  for (let n = 0; n < points.length - 1; n += 1) {
    const [a, b] = [points[n]!, points[n + 1]!];
    const before = points[n - 1] ?? a;
    const after = points[n + 2] ?? b;
    for (let step = 0; step < per; step += 1) {
      const t = step / per;
      result.push({ x: spline(before.x, a.x, b.x, after.x, t), z: spline(before.z, a.z, b.z, after.z, t) });
    }
  }
  result.push(points.at(-1)!);
  return result;
}

/** Where the path is at a time; before and behind it its ends. */
export function placeAt(path: TimedPath, time: number): Ground {
  const { points, times } = path;
  const index = times.findIndex((one) => one > time);
  if (index === 0) return points[0]!;
  if (index < 0) return points.at(-1)!;
  const [a, b] = [points[index - 1]!, points[index]!];
  const t = (time - times[index - 1]!) / Math.max(times[index]! - times[index - 1]!, 1e-9);
  const before = points[index - 2] ?? a;
  const after = points[index + 1] ?? b;
  if (apart(a, b) < 1e-9) return a;
  return { x: spline(before.x, a.x, b.x, after.x, t), z: spline(before.z, a.z, b.z, after.z, t) };
}

/** A drawn line as few points: those without which it would be more than `tolerance` metres elsewhere. */
export function simplified(line: readonly Ground[], tolerance = 0.08): Ground[] {
  if (line.length < 3) return [...line];
  const [first, last] = [line[0]!, line.at(-1)!];
  let farthest = 0;
  let at = 0;
  for (let n = 1; n < line.length - 1; n += 1) {
    const distance = toSegment(line[n]!, first, last);
    if (distance > farthest) [farthest, at] = [distance, n];
  }
  if (farthest <= tolerance) return [first, last];
  return [...simplified(line.slice(0, at + 1), tolerance).slice(0, -1), ...simplified(line.slice(at), tolerance)];
}

/** The joint's distance from a target, in metres. */
export function distance(a: Vec3, b: Vec3): number {
  return Math.hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

function toSegment(point: Ground, a: Ground, b: Ground): number {
  const squared = (b.x - a.x) ** 2 + (b.z - a.z) ** 2;
  const t = squared ? clamp(((point.x - a.x) * (b.x - a.x) + (point.z - a.z) * (b.z - a.z)) / squared, 0, 1) : 0;
  return apart(point, { x: a.x + t * (b.x - a.x), z: a.z + t * (b.z - a.z) });
}

function withoutDoubles(points: readonly PathPoint[]): PathPoint[] {
  return points.filter((point, index) => index === 0 || apart(points[index - 1]!, point) > 0.01);
}

function spline(before: number, a: number, b: number, after: number, t: number): number {
  const [m0, m1] = [(b - before) / 2, (after - a) / 2];
  const [t2, t3] = [t * t, t * t * t];
  return (2 * t3 - 3 * t2 + 1) * a + (t3 - 2 * t2 + t) * m0 + (-2 * t3 + 3 * t2) * b + (t3 - t2) * m1;
}
