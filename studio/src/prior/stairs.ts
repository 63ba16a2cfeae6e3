/**
 * Nobody hangs in the air or sinks into the floor: steps of one height under who climbs, the floor under who hovers and
 * under hands (`motionloom.tasks.supported`, `motionloom.kinematics.stairs`).
 */

import { cleanFeet, type Span, spans } from "./feet";
import { type Target, fitBody } from "./fit";
import { between } from "./path";
import { type Body, HEAD, LEFT, RIGHT, placesOf } from "./person";
import { type Vec, add, minus, norm, rounded, scaled } from "./turns";

/** Metres of the lowest joint over the floor from which on somebody is above it. */
const UP = 0.12;
/** Seconds: nobody who jumps is in the air longer. */
const FLIGHT = 0.8;
/** Metres between the lowest and the highest foothold of stairs. */
const CLIMB = 0.3;
/** Metres that steps may be high. */
const RISES = Array.from({ length: 11 }, (_, n) => 0.15 + 0.005 * n);
/** Metres per second of a foot that bears. */
const SLOW = 0.6;
/** Metres by which a hand or the head may be under the floor, and over it where they come to lie. */
const SUNK = 0.02;
const REST = [
  [LEFT.wrist, 0.02],
  [RIGHT.wrist, 0.02],
  [HEAD, 0.06],
] as const;
const SIDES = [LEFT, RIGHT] as const;

/** Where a foot bears the body for a while; metres of the toe over the floor. */
interface Foothold {
  readonly side: 0 | 1;
  readonly first: number;
  readonly end: number;
  readonly height: number;
}

/** Steps of one height, and which of them each foothold is on. */
interface Stairs {
  readonly rise: number;
  readonly holds: readonly Foothold[];
  readonly levels: readonly number[];
}

/** The body on the floor y = 0, with steps under its feet where it climbs. */
export function supported(body: Body): Body {
  const places = placesOf(body);
  return aboveFloor(hovering(places, body.fps).length ? grounded(body, places) : onStairs(body, places));
}

function onStairs(body: Body, places: readonly Vec[][]): Body {
  const found = stairs(places, body.fps);
  if (!found) return body;
  const lifts: (number | null)[] = places.map(() => null);
  const wanted = SIDES.map(({ ankle }): { joint: number; places: Vec[]; asked: Vec[] } => {
    return { joint: ankle, places: places.map((at) => at[ankle]!), asked: places.map(() => [0, 0, 0]) };
  });
  found.holds.forEach(({ side, first, end, height }, n) => {
    const { joint, places: to, asked } = wanted[side]!;
    const off = found.levels[n]! * found.rise - height;
    const own = places.slice(first, end).map((at) => at[joint]!);
    const [x, y, z] = [0, 1, 2].map((k) => median(own.map((at) => at[k]!))) as [number, number, number];
    for (let f = first; f < end; f += 1) [to[f], asked[f], lifts[f]] = [[x, y + off, z], [1, 1, 1], off];
  });
  const known = lifts.flatMap((lift, f) => (lift === null ? [] : [f]));
  const lift = averaged(
    places.map((_, f) =>
      between(
        f,
        known,
        known.map((n) => lifts[n]!),
      ),
    ),
    odd(body.fps / 2),
  );
  return fitBody({ ...body, root: body.root.map((at, f) => add(at, [0, lift[f]!, 0])) }, wanted);
}

/** Lowered by as much as the lowest joint is above the floor, a quarter of a second averaged, and not into the floor. */
function grounded(body: Body, places: readonly Vec[][]): Body {
  const above = Array.from(lowest(places), (y) => Math.max(y, 0));
  const mean = averaged(above, odd(body.fps / 4));
  const drop = above.map((y, f) => Math.min(mean[f]!, y));
  return cleanFeet({ ...body, root: body.root.map((at, f) => add(at, [0, -drop[f]!, 0])) }, null);
}

/** Hands and head brought up to the floor where they are under it. */
function aboveFloor(body: Body): Body {
  const places = placesOf(body);
  const wanted = REST.map(([joint, rest]): Target => {
    return {
      joint,
      places: places.map((at): Vec => [at[joint]![0], rest, at[joint]![2]]),
      asked: places.map((at): Vec => [0, at[joint]![1] < rest - SUNK ? 1 : 0, 0]),
    };
  });
  return fitBody(body, wanted);
}

/** Whether somebody is above the floor for longer than a jump takes, of the heights of the lowest joint. */
export function isUp(low: readonly number[], fps: number): boolean {
  return (
    lasting(
      low.map((y) => y > UP),
      fps,
    ).length > 0
  );
}

/** The stairs that somebody goes up or down; null on the floor, and where the feet bear nowhere for a while. */
export function stairs(places: readonly Vec[][], fps: number): Stairs | null {
  if (!isUp(lowest(places), fps) || hovering(places, fps).length) return null;
  const holds = footholds(places, fps);
  if (!holds.length) return null;
  const heights = holds.map(({ height }) => height);
  if (Math.max(...heights) - Math.min(...heights) < CLIMB) return null;
  const off = RISES.map((rise) => heights.reduce((sum, y) => sum + Math.abs(y - rise * rounded(y / rise)), 0));
  const rise = Math.round(RISES[off.indexOf(Math.min(...off))]! * 1000) / 1000;
  const levels = heights.map((y) => Math.max(rounded(y / rise), 0));
  const up = heights.at(-1)! >= heights[0]!;
  return { rise, holds, levels: up ? oneByOne(levels) : oneByOne(levels.reverse()).reverse() };
}

/** Levels that rise by one at the most, and never fall: nobody takes four steps at once. */
function oneByOne(levels: readonly number[]): number[] {
  let [most, at] = [levels[0]!, 0];
  return levels.map((level) => {
    const next = Math.max(most, level);
    at += Math.min(next - most, 1);
    most = next;
    return at;
  });
}

/** Where a foot is slow and nothing but the other foot is 5 cm lower, in the order of time. */
function footholds(places: readonly Vec[][], fps: number): Foothold[] {
  const feet = SIDES.flatMap(({ ankle, foot }) => [ankle, foot]);
  const others = places.map((at) => Math.min(...at.filter((_, joint) => !feet.includes(joint)).map(([, y]) => y)));
  const found = SIDES.flatMap(({ ankle, foot }, side) => {
    const speed = speeds(places, ankle, fps);
    const bears = places.map((at, f) => {
      const height = Math.min(at[foot]![1], at[ankle]![1]);
      return speed[f]! < SLOW && height < others[f]! + 0.05;
    });
    return spans(bears)
      .filter(([first, end]) => end - first >= 0.15 * fps)
      .map(([first, end]): Foothold => {
        const height = median(places.slice(first, end).map((at) => at[foot]![1]));
        return { side: side as 0 | 1, first, end, height };
      });
  });
  return found.sort((a, b) => a.first + a.end - b.first - b.end);
}

/** Ranges of frames in which somebody is above the floor and nothing bears them for longer than a jump. */
function hovering(places: readonly Vec[][], fps: number): Span[] {
  const speed = places[0]!.map((_, joint) => speeds(places, joint, fps));
  const low = lowest(places);
  const borne = places.map((at, f) => speed[at.findIndex(([, y]) => y === low[f])]![f]! < SLOW);
  for (const { first, end } of footholds(places, fps)) borne.fill(true, first, end);
  return lasting(
    low.map((y, f) => y > UP && !borne[f]),
    fps,
  );
}

const lasting = (flags: readonly boolean[], fps: number): Span[] =>
  spans(flags).filter(([first, end]) => end - first > FLIGHT * fps);

const lowest = (places: readonly Vec[][]): number[] => places.map((at) => Math.min(...at.map(([, y]) => y)));

/** Metres per second of a joint, three frames averaged. */
function speeds(places: readonly Vec[][], joint: number, fps: number): number[] {
  const last = places.length - 1;
  const moves = places.map((_, f): Vec => {
    const [a, b] = [Math.max(f - 1, 0), Math.min(f + 1, last)];
    return b > a ? scaled(minus(places[b]![joint]!, places[a]![joint]!), fps / (b - a)) : [0, 0, 0];
  });
  const [x, y, z] = [0, 1, 2].map((k) =>
    averaged(
      moves.map((one) => one[k]!),
      3,
    ),
  );
  return moves.map((_, f) => norm([x![f]!, y![f]!, z![f]!]));
}

/** Averages over an odd number of frames; the ends average what is there. */
function averaged(values: readonly number[], frames: number): number[] {
  const half = Math.floor(frames / 2);
  return values.map((_, f) => {
    const part = values.slice(Math.max(f - half, 0), f + half + 1);
    return part.reduce((sum, x) => sum + x, 0) / part.length;
  });
}

/** The nearest odd number of frames. */
const odd = (frames: number): number => Math.max(1, 2 * rounded((frames - 1) / 2) + 1);

function median(values: readonly number[]): number {
  const sorted = [...values].sort((a, b) => a - b);
  const middle = sorted.length / 2;
  return (sorted[Math.ceil(middle) - 1]! + sorted[Math.floor(middle)]!) / 2;
}
