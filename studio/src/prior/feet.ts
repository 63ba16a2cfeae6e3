/** Planted feet stay put, and no foot is under the floor (`motionloom.core.body.feet`). */

import { eachJoint, percentile } from "./body";
import { aim, hingeFrame, reach } from "./limbs";
import { type Body, LEFT, LENGTHS, LIMBS, type Limb, PELVIS, REST, RIGHT, placesOf, worldOf } from "./person";
import {
  type Turn,
  type Vec,
  add,
  clip,
  inverse,
  minus,
  norm,
  normalized,
  rotate,
  rounded,
  scaled,
  shortestArc,
  smoothstep,
  times,
  unit,
  unroll,
} from "./turns";

const EASE = 0.25;
const TURN_EASE = 0.1;
const LOW = [0.11, 0.05, 0.11, 0.05] as const;
/** Metres per second: what starts a contact, what keeps it, and what a foot said to be planted may have. */
const [SLOW, STILL_SLOW, TOLD_SLOW] = [0.35, 0.5, 0.6] as const;
const DRIFT = 0.12;
/** How far a foot may turn while it stands flat, and how far it turns in one step if it turns further. */
const [TURNS, STEP] = [(35 * Math.PI) / 180, (45 * Math.PI) / 180] as const;
/** Seconds that such a step takes, and metres that the foot is lifted in the middle of it. */
const [SWING, LIFT] = [0.3, 0.05] as const;
const SUNK = 0.002;
/** Metres: somebody whose toes rest this near to the floor rests on it, and who is three times as far does not. */
const NEAR = 0.01;
/** Metres from there below which planted toes are brought there wholly, and at all, if they move up or down slower. */
const [RESTING, LIFTED, SLOWLY] = [0.02, 0.03, 0.2] as const;
const LIFT_EASE = 0.05;
/** Left ankle, left foot, right ankle, right foot: the order of the flags. */
export const FEET = [LEFT.ankle, LEFT.foot, RIGHT.ankle, RIGHT.foot] as const;
const NONE: Vec = [0, 0, 0];

export type Span = readonly [number, number];
type Contacts = readonly (readonly number[])[] | null;

/** The body with planted feet locked; `contacts`: four numbers a frame as the features have them; null: as it looks. */
export function cleanFeet(body: Body, contacts: Contacts): Body {
  const { fps } = body;
  if (body.root.length < 4) return body;
  const places = placesOf(body);
  const standing = standingFeet(places, fps, contacts);
  const planted = inSteps(places, standing, fps);
  const level = toeLevel(places, fps);
  const height = level - clip(level, -NEAR, NEAR) * clip((3 * NEAR - Math.abs(level)) / (2 * NEAR), 0, 1);
  const feet = [0, 1].map((side) => {
    const [ankle, toe] = [FEET[2 * side]!, FEET[2 * side + 1]!];
    const flags = planted.map((row) => [row[2 * side]!, row[2 * side + 1]!] as const);
    const foot = places.map((at) => minus(at[toe]!, at[ankle]!));
    const directions = steadyDirections(
      foot,
      flags.map(([heel, tip]) => heel && tip),
      fps,
    );
    const tips = directions.map((way, f) => scaled(way, norm(foot[f]!)));
    const start = places.map((at) => minus(at[ankle]!, [0, height, 0]));
    const moved = correction(
      start,
      start.map((at, f) => add(at, tips[f]!)),
      flags,
      fps,
    );
    const lifts = liftsOf(standing.map((row, f) => [0, 1].some((k) => row[2 * side + k]) && !flags[f]!.some(Boolean)));
    let targets = places.map((at, f) => add(add(at[ankle]!, moved[f]!), [0, lifts[f]!, 0]));
    const stretched = envelope(
      targets.map((at, f) => overreach(LIMBS[side]!, places[f]!, at)),
      rounded(LIFT_EASE * fps),
    );
    targets = targets.map((at, f) => add(at, [0, Math.min(stretched[f]!, -Math.min(moved[f]![1], 0)), 0]));
    const below = targets.map((at, f) => Math.max(-at[1] - Math.min(tips[f]![1], 0) - SUNK, 0));
    const lift = envelope(below, rounded(LIFT_EASE * fps));
    return { targets: targets.map((at, f) => add(at, [0, lift[f]!, 0])), directions };
  });
  const need = places.map((at, f) =>
    clip(Math.max(...LIMBS.slice(0, 2).map((limb, i) => overreach(limb, at, feet[i]!.targets[f]!))), 0, 0.05),
  );
  const down = envelope(need, rounded(0.15 * fps));
  const lowered = places.map((at, f) => at.map((place) => add(place, [0, -down[f]!, 0])));
  return withLegs(body, lowered, feet);
}

/** Four flags a frame: low, slow, said to be planted, long enough to be a step, and no step of a turn. */
export function plantedFeet(places: readonly Vec[][], fps: number, contacts: Contacts): boolean[][] {
  return inSteps(places, standingFeet(places, fps, contacts), fps);
}

/** The same, of which some turn. */
function standingFeet(places: readonly Vec[][], fps: number, contacts: Contacts): boolean[][] {
  const speed = speedOfFeet(places, fps);
  const height = places.map((at) => FEET.map((joint) => at[joint]![1]));
  const level = toeLevel(places, fps);
  const may = places.map((_, f) =>
    FEET.map((__, k) => {
      if (height[f]![k]! >= level + LOW[k]!) return false;
      return contacts ? speed[f]![k]! < TOLD_SLOW && contacts[f]![k]! > 0.5 : speed[f]![k]! < STILL_SLOW;
    }),
  );
  const [least, gap] = [Math.max(2, rounded(0.12 * fps)), Math.max(1, rounded(0.1 * fps))];
  const result = may.map(() => [false, false, false, false]);
  for (const k of FEET.keys()) {
    const sure = ([start, stop]: Span): boolean => !!contacts || speed.slice(start, stop).some((row) => row[k]! < SLOW);
    for (const [start, stop] of joined(spans(may.map((row) => row[k]!)).filter(sure), gap))
      for (let f = start; f < stop; f += 1) result[f]![k] = stop - start >= least;
  }
  return result;
}

/** Flags without those of flat feet that turn: a step at a time, the foot of that side first. */
function inSteps(places: readonly Vec[][], standing: readonly (readonly boolean[])[], fps: number): boolean[][] {
  const result = standing.map((row) => [...row]);
  const half = Math.max(1, rounded((SWING * fps) / 2));
  for (const side of [0, 1]) {
    const [ankle, toe] = [FEET[2 * side]!, FEET[2 * side + 1]!];
    for (const [start, stop] of spans(standing.map((row) => row[2 * side]! && row[2 * side + 1]!))) {
      const feet = places.slice(start, stop).map((at) => minus(at[toe]!, at[ankle]!));
      const [way, turned] = [[Math.atan2(feet[0]![0], feet[0]![2])], [0]];
      for (const [x, , z] of feet.slice(1)) {
        const more = Math.atan2(x, z) - way.at(-1)!;
        const near = more - 2 * Math.PI * Math.round(more / (2 * Math.PI));
        way.push(way.at(-1)! + near);
        turned.push(turned.at(-1)! + Math.abs(near));
      }
      const wide = Math.max(...way) - Math.min(...way);
      if (wide < TURNS) continue;
      const steps = Math.max(1, rounded(wide / STEP));
      const first = way.at(-1)! > way[0]! === (side === 0) ? 0.25 : 0.75;
      for (let k = 0; k < steps; k += 1) {
        const middle = start + turned.findIndex((sum) => sum >= (turned.at(-1)! * (k + first)) / steps);
        for (let f = Math.max(middle - half, 0); f < Math.min(middle + half, result.length); f += 1)
          result[f]![2 * side] = result[f]![2 * side + 1] = false;
      }
    }
  }
  return result;
}

/** Metres that a foot is lifted while it makes the steps of a turn. */
function liftsOf(swings: readonly boolean[]): number[] {
  const lifts = swings.map(() => 0);
  for (const [start, stop] of spans(swings))
    for (let f = start; f < stop; f += 1)
      lifts[f] = LIFT * Math.sin((Math.PI * (f - start + 1)) / (stop - start + 1)) ** 2;
  return lifts;
}

/** Height at which toes rest; that of the lowest where none do. */
function toeLevel(places: readonly Vec[][], fps: number): number {
  const speed = speedOfFeet(places, fps);
  const resting = places.flatMap((at, f) => [1, 3].filter((k) => speed[f]![k]! < SLOW).map((k) => at[FEET[k]!]![1]));
  return resting.length ? percentile(resting, 30) : Math.min(...places.flatMap((at) => FEET.map((k) => at[k]![1])));
}

/** Metres per second of the four joints in each frame. */
function speedOfFeet(places: readonly Vec[][], fps: number): number[][] {
  const last = places.length - 1;
  return places.map((_, f) =>
    FEET.map((joint) => {
      const [a, b] = [Math.max(f - 1, 0), Math.min(f + 1, last)];
      return (norm(minus(places[b]![joint]!, places[a]![joint]!)) / (b - a)) * fps;
    }),
  );
}

/** Half-open ranges of consecutive true flags. */
export function spans(flags: readonly boolean[]): Span[] {
  const found: [number, number][] = [];
  flags.forEach((flag, f) => {
    if (flag && !flags[f - 1]) found.push([f, f]);
    if (flag) found.at(-1)![1] = f + 1;
  });
  return found;
}

function joined(runs: readonly Span[], gap: number): Span[] {
  const result: Span[] = [];
  for (const [start, stop] of runs) {
    const before = result.at(-1);
    if (before && start - before[1] <= gap) result[result.length - 1] = [before[0], stop];
    else result.push([start, stop]);
  }
  return result;
}

/** Unit directions from ankle to toes; one direction while the whole foot is on the floor. */
function steadyDirections(foot: readonly Vec[], flat: readonly boolean[], fps: number): Vec[] {
  const units = foot.map(unit);
  let result = [...units];
  const [runs, ease] = [spans(flat), Math.max(1, rounded(TURN_EASE * fps))];
  runs.forEach(([start, stop], i) => {
    const before = i ? Math.min(ease, start - runs[i - 1]![1] + 1) : ease;
    const after = i + 1 < runs.length ? Math.min(ease, runs[i + 1]![0] - stop + 1) : ease;
    const sum = units.slice(start, stop).reduce((all, one) => add(all, one), NONE);
    const steady = scaled(sum, 1 / (stop - start));
    result = result.map((way, f) => {
      const away = Math.max((start - f) / before, (f - stop + 1) / after);
      return add(way, minus(steady, way), 1 - smoothstep(away));
    });
  });
  return result.map(unit);
}

/** Metres to add to a foot so that whatever is planted does not move and resting toes rest on height 0; eased. */
function correction(
  ankle: readonly Vec[],
  toe: readonly Vec[],
  planted: readonly (readonly [boolean, boolean])[],
  fps: number,
): Vec[] {
  const steps = ankle.slice(1).map((_, f): Vec => {
    const both = [0, 1].map((k) => planted[f]![k]! && planted[f + 1]![k]!);
    const place = both[1] ? toe : both[0] ? ankle : null;
    if (!place) return NONE;
    const [x, , z] = minus(place[f]!, place[f + 1]!);
    return [x, 0, z];
  });
  const found = pieces(
    steps,
    planted.map(([heel, tip]) => heel || tip),
    Math.max(2, rounded((EASE * fps) / 2)),
  );
  for (const [start, path] of found) {
    const down = toFloor(toe.slice(start, start + path.length), planted.slice(start, start + path.length), fps);
    path.forEach((value, n) => (path[n] = [value[0], down[n]!, value[2]]));
  }
  const result: Vec[] = ankle.map(() => NONE);
  for (const [start, path] of found) path.forEach((value, n) => (result[start + n] = value));
  bridge(
    result,
    found.map(([start, path]) => [start, start + path.length] as const),
    Math.max(2, rounded(EASE * fps)),
  );
  return result;
}

/** Metres to add to the heights of a stance's toes; toes that begin to rise may. */
function toFloor(toe: readonly Vec[], planted: readonly (readonly [boolean, boolean])[], fps: number): number[] {
  const height = toe.map((at) => at[1]);
  const last = height.length - 1;
  const resting = [...height.keys()].filter((f) => {
    const [a, b] = [Math.max(f - 1, 0), Math.min(f + 1, last)];
    const speed = (Math.abs(height[b]! - height[a]!) / (b - a)) * fps;
    return planted[f]![1] && speed < SLOWLY;
  });
  const down = height.map((at) => -at * clip((LIFTED - Math.abs(at)) / (LIFTED - RESTING), 0, 1));
  return height.map((_, f) => {
    const after = resting.findIndex((one) => one >= f);
    if (resting.length === 0) return 0;
    if (after === 0) return down[resting[0]!]!;
    if (after < 0) return down[resting.at(-1)!]!;
    const [a, b] = [resting[after - 1]!, resting[after]!];
    return down[a]! + ((f - a) / (b - a)) * (down[b]! - down[a]!);
  });
}

/** First frame and correction of each stance, of mean 0; stances that stray are split where they are fastest. */
function pieces(steps: readonly Vec[], standing: readonly boolean[], hole: number): [number, Vec[]][] {
  const waiting = spans(standing).reverse();
  const found: [number, Vec[]][] = [];
  for (let next = waiting.pop(); next; next = waiting.pop()) {
    const [start, stop] = next;
    if (stop - start < 2) continue;
    let path: Vec[] = [NONE];
    for (const step of steps.slice(start, stop - 1)) path.push(add(path.at(-1)!, step));
    const mean = scaled(
      path.reduce((sum, at) => add(sum, at), NONE),
      1 / path.length,
    );
    path = path.map((at) => minus(at, mean));
    if (Math.max(...path.map(norm)) <= DRIFT) {
      found.push([start, path]);
      continue;
    }
    const sizes = steps.slice(start, stop - 1).map(norm);
    const fastest = start + sizes.indexOf(Math.max(...sizes));
    waiting.push([fastest + 1 + hole, stop], [start, fastest + 1 - hole]);
  }
  return found;
}

/** Fill the frames between pieces, in place: short gaps directly, else by way of zero. */
function bridge(values: Vec[], held: readonly Span[], ease: number): void {
  const frames = values.length;
  const ends: Span[] = [[-ease, -ease], ...held, [frames + ease, frames + ease]];
  const slope = (at: number, towards: number): Vec => {
    const inner = at + Math.sign(towards - at);
    return scaled(minus(values[at]!, values[inner]!), Math.sign(at - inner));
  };
  ends.slice(1).forEach(([start, last], n) => {
    const [first, stop] = ends[n]!;
    if (stop === start) return;
    if (0 < stop && stop < start && start < frames && start - stop < 2 * ease) {
      const [into, out] = [slope(stop - 1, first), slope(start, last - 1)];
      const curve = hermite(start - stop + 1, values[stop - 1]!, values[start]!, into, out);
      curve.forEach((value, k) => (values[stop + k] = value));
      return;
    }
    if (0 < stop && stop < frames) {
      const curve = hermite(ease, values[stop - 1]!, NONE, slope(stop - 1, first), NONE);
      curve.slice(0, frames - stop).forEach((value, k) => (values[stop + k] = value));
    }
    if (0 < start && start < frames) {
      const curve = hermite(ease, NONE, values[start]!, NONE, slope(start, last - 1));
      const count = Math.min(start, ease - 1);
      curve.slice(ease - 1 - count).forEach((value, k) => (values[start - count + k] = value));
    }
  });
}

/** Values strictly between two ends so many frames apart, with given changes per frame there. */
function hermite(steps: number, left: Vec, right: Vec, into: Vec, out: Vec): Vec[] {
  return Array.from({ length: steps - 1 }, (_, k) => {
    const u = (k + 1) / steps;
    const [leaving, end, coming] = [u ** 3 - 2 * u ** 2 + u, 3 * u ** 2 - 2 * u ** 3, u ** 3 - u ** 2];
    return add(add(add(left, minus(right, left), end), into, steps * leaving), out, steps * coming);
  });
}

/** A smooth curve nowhere below `need`: running maximum, then averages within its window. */
function envelope(need: readonly number[], size: number): number[] {
  const radius = Math.max(1, size);
  const at = (n: number): number => need[clip(n, 0, need.length - 1)]!;
  let curve = Array.from({ length: need.length + 4 * radius }, (_, n) => {
    let most = -Infinity;
    for (let k = n - 4 * radius; k <= n; k += 1) most = Math.max(most, at(k));
    return most;
  });
  for (let round = 0; round < 2; round += 1) {
    curve = curve.slice(2 * radius).map((_, n) => {
      let sum = 0;
      for (let k = n; k <= n + 2 * radius; k += 1) sum += curve[k]!;
      return sum / (2 * radius + 1);
    });
  }
  return curve;
}

/** Metres that an ankle's target is too low for a leg stretched as far as it was, or to 99.5 %. */
function overreach(limb: Limb, places: readonly Vec[], target: Vec): number {
  const full = LENGTHS[limb.middle]! + LENGTHS[limb.end]!;
  const most = Math.max(norm(minus(places[limb.end]!, places[limb.start]!)), 0.995 * full);
  const line = minus(target, places[limb.start]!);
  const height = Math.sqrt(Math.max(most ** 2 - line[0] ** 2 - line[2] ** 2, 0));
  return norm(line) > most ? Math.max(-line[1] - height, 0) : 0;
}

interface Foot {
  readonly targets: readonly Vec[];
  readonly directions: readonly Vec[];
}

/** The body with its root as placed, and ankles and feet as wanted. */
function withLegs(body: Body, places: readonly Vec[][], feet: readonly Foot[]): Body {
  const turns = body.turns.map((own, f) => {
    const [world, result] = [worldOf(own), [...own]];
    LIMBS.slice(0, 2).forEach((limb, i) => {
      const [upper, lower] = solveLeg(limb, world, places[f]!, feet[i]!.targets[f]!);
      const foot = aim(world[limb.end]!, REST[limb.tip!]!, feet[i]!.directions[f]!);
      result[limb.start] = times(inverse(world[PELVIS]!), upper);
      result[limb.middle] = times(inverse(upper), lower);
      result[limb.end] = times(inverse(lower), foot);
    });
    return result.map(normalized);
  });
  eachJoint(turns, unroll);
  return { ...body, root: places.map((at) => at[PELVIS]!), turns };
}

/** World turns of hip and knee for an ankle at `target`; those there are where it is there. */
function solveLeg(limb: Limb, world: readonly Turn[], places: readonly Vec[], target: Vec): [Turn, Turn] {
  const { start: a, middle: b, end: c, hinge } = limb;
  const [start, lengths] = [places[a]!, [LENGTHS[b]!, LENGTHS[c]!] as const];
  const full = lengths[0] + lengths[1];
  const [old, next] = [minus(places[c]!, start), minus(target, start)];
  const [before, wanted] = [norm(old), norm(next)];
  const bent = Math.max(before, 0.995 * full);
  const room = Math.max(Math.max(before, 0.999 * full) - bent, 1e-6);
  const far = Math.max(wanted - bent, 0);
  const distance = far > 0 ? bent + room * Math.tanh(far / room) : wanted;
  const goal = add(start, next, distance / Math.max(wanted, 1e-9));
  const arc = shortestArc(old, next);
  const [first, second] = [a, b].map((joint) => rotate(arc, rotate(world[joint]!, hinge))) as [Vec, Vec];
  const [knee, ankle] = reach(start, goal, [start, places[b]!, places[c]!], first, lengths);
  return [hingeFrame(limb, b, minus(knee, start), first), hingeFrame(limb, c, minus(ankle, knee), second)];
}
