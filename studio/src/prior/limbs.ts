/** Arms and legs from places: two bones, and a hinge whose turn about the limb is smooth (`motionloom.core.body.ik`). */

import { unwrapAngles } from "./dense";
import { LENGTHS, LIMBS, type Limb, REST } from "./person";
import {
  type Turn,
  type Vec,
  across,
  add,
  clip,
  cross,
  dot,
  inverse,
  minus,
  norm,
  normalized,
  ofColumns,
  other,
  rotate,
  scaled,
  shortestArc,
  smoothstep,
  times,
  tridiagonal,
  unit,
} from "./turns";

const BENT = [Math.sin((6 * Math.PI) / 180), Math.sin((25 * Math.PI) / 180)] as const;
const NEARLY_STRAIGHT = [0.95, 0.995] as const;

/** Square metres: the product of leg and hips below which a leg along the line of the hips has no front, and has one. */
const ASIDE = [0.01, 0.03] as const;

/** The places, knees that bend the wrong way mirrored at the plane through hip, ankle and the line of the hips. */
export function withKneesAhead(seen: readonly Vec[][]): Vec[][] {
  return seen.map((at) => {
    const result = [...at];
    const hips = minus(at[LIMBS[0]!.start]!, at[LIMBS[1]!.start]!);
    for (const { start, middle, end } of LIMBS.slice(0, 2)) {
      const front = cross(minus(at[end]!, at[start]!), hips);
      const depth = dot(minus(at[middle]!, at[start]!), unit(front));
      result[middle] = add(at[middle]!, unit(front), -2 * between(norm(front), ASIDE) * Math.min(depth, 0));
    }
    return result;
  });
}

/** Fill in places and world turns of the limbs, feet included; those of the trunk are there. */
export function solveLimbs(seen: Vec[][], places: Vec[][], world: Turn[][], fps: number): void {
  for (const limb of LIMBS) {
    const axes = hingeAxes(limb, seen, world, fps);
    const { start: a, middle: b, end: c, tip } = limb;
    axes.forEach((axis, f) => {
      const [here, turns, at] = [places[f]!, world[f]!, seen[f]!];
      [here[b], here[c]] = twoBones(here[a]!, [at[a]!, at[b]!, at[c]!], axis, [LENGTHS[b]!, LENGTHS[c]!]);
      turns[a] = hingeFrame(limb, b, minus(here[b]!, here[a]!), axis);
      turns[b] = hingeFrame(limb, c, minus(here[c]!, here[b]!), axis);
      turns[c] = turns[b]!;
      if (tip !== null) turns[c] = turns[tip] = aim(turns[b]!, REST[tip]!, minus(at[tip]!, at[c]!));
    });
  }
}

/** Turn an orientation the shortest way so that `rest` points along `direction`. */
export function aim(orientation: Turn, rest: Vec, direction: Vec): Turn {
  const now = rotate(orientation, rest);
  return normalized(times(shortestArc(now, norm(direction) < 1e-6 ? now : direction), orientation));
}

/** The world orientation with the bone to `child` along `bone`, the hinge nearest `axis`. */
export function hingeFrame(limb: Limb, child: number, bone: Vec, axis: Vec): Turn {
  const frame = (along: Vec, hinge: Vec): Turn => {
    const y = unit(along);
    const x = across(hinge, y);
    return ofColumns(x, y, cross(x, y));
  };
  return times(frame(bone, axis), inverse(frame(REST[child]!, limb.hinge)));
}

type Three = readonly [Vec, Vec, Vec];

/** Middle and end of a limb whose end reaches its place; near full reach the seen bend decides how far it gets. */
function twoBones(start: Vec, seen: Three, axis: Vec, lengths: readonly [number, number]): [Vec, Vec] {
  const [first, second] = lengths;
  const bend = clip(dot(unit(minus(seen[1], seen[0])), unit(minus(seen[2], seen[1]))), -1, 1);
  const byBend = Math.sqrt(Math.max(first ** 2 + second ** 2 + 2 * first * second * bend, 0));
  const wanted = minus(seen[2], start);
  const distance = norm(wanted);
  const near = between(distance / (first + second), NEARLY_STRAIGHT);
  return reach(start, add(start, unit(wanted), distance + near * (byBend - distance)), seen, axis, lengths);
}

/** Middle and end of a limb from `start` to `target`, the middle on the side where it is seen. */
export function reach(
  start: Vec,
  target: Vec,
  seen: Three,
  axis: Vec,
  [first, second]: readonly [number, number],
): [Vec, Vec] {
  const line = unit(minus(target, start));
  const distance = clip(norm(minus(target, start)), Math.abs(first - second) + 1e-6, first + second);
  const along = (first ** 2 + distance ** 2 - second ** 2) / (2 * distance);
  const off = Math.sqrt(Math.max(first ** 2 - along ** 2, 0));
  const middle = add(add(start, line, along), side(seen, line, axis, off), off);
  return [middle, add(start, line, distance)];
}

/** Unit vector across `line` towards the middle joint. */
function side(seen: Three, line: Vec, axis: Vec, off: number): Vec {
  const chord = unit(minus(seen[2], seen[0]));
  const bone = minus(seen[1], seen[0]);
  const bent = rotate(shortestArc(chord, line), add(bone, chord, -dot(bone, chord)));
  const missing = Math.max(off - norm(bent), 0) + 2e-4;
  return across(add(bent, unit(cross(line, axis)), missing), line);
}

/** World hinge axes of a limb, frame by frame, across its upper bone and smooth in time. */
function hingeAxes(limb: Limb, seen: Vec[][], world: Turn[][], fps: number): Vec[] {
  const local = world.map((turns) => inverse(turns[limb.base]!));
  const bone = (a: number, b: number): Vec[] => seen.map((at, f) => unit(rotate(local[f]!, minus(at[b]!, at[a]!))));
  const [upper, lower] = [bone(limb.start, limb.middle), bone(limb.middle, limb.end)];
  const first = transport(upper);
  const second = upper.map((way, f) => cross(way, first[f]!));
  const plane = (v: Vec, f: number): Complex => [dot(v, first[f]!), dot(v, second[f]!)];
  const bend = upper.map((way, f) => plane(cross(way, lower[f]!), f));
  const usual = upper.map((way, f) => plane(usualAxis(limb, seen[f]!, way, lower[f]!, local[f]!), f));
  const strength = bend.map(([x, y]) => between(Math.hypot(x, y), BENT));
  return smoothAngles(bend, strength, usual, (fps / 20) ** 2).map((angle, f) =>
    rotate(world[f]![limb.base]!, add(scaled(first[f]!, Math.cos(angle)), second[f]!, Math.sin(angle))),
  );
}

/** Where a hinge points when no bend is seen: the rest axis carried by the shortest arc; the foot. */
function usualAxis(limb: Limb, seen: readonly Vec[], upper: Vec, lower: Vec, local: Turn): Vec {
  const rest = REST[limb.middle]!;
  const carried = rotate(shortestArc(rest, upper), limb.hinge);
  const axis = scaled(carried, clip(1.1 + dot(unit(rest), upper), 0, 1));
  if (limb.tip === null) return axis;
  const foot = rotate(local, unit(minus(seen[limb.tip]!, seen[limb.end]!)));
  const [along, aside] = aboutShin(unit(REST[limb.tip]!), unit(REST[limb.end]!));
  const [forward, lateral] = aboutShin(foot, lower);
  return add(add(scaled(axis, 0.15), forward, dot(limb.hinge, along)), lateral, dot(limb.hinge, aside));
}

/** The part of a foot across the shin, and the same a right angle further round the shin. */
function aboutShin(foot: Vec, shin: Vec): [Vec, Vec] {
  return [add(foot, shin, -dot(foot, shin)), cross(shin, foot)];
}

/** Unit vectors across directions, carried from frame to frame by the shortest arc. */
function transport(directions: readonly Vec[]): Vec[] {
  let carried = across(other(directions[0]!), directions[0]!);
  return directions.map((way, f) => {
    if (f) carried = rotate(shortestArc(directions[f - 1]!, way), carried);
    return across(carried, way);
  });
}

type Complex = readonly [number, number];

const onCircle = ([x, y]: Complex): Complex => {
  const size = Math.max(Math.hypot(x, y), 1e-9);
  return [x / size, y / size];
};

/** Angles that follow `bend` where `strength` says so and hold elsewhere: on the circle, then refined as angles. */
function smoothAngles(
  bend: readonly Complex[],
  strength: readonly number[],
  usual: readonly Complex[],
  stiffness: number,
): number[] {
  const weak = usual.map(([x, y]) => 0.02 * Math.min(Math.hypot(x, y), 1));
  const all = strength.map((weight, f) => weight + weak[f]! + 1e-6);
  const [goal, hint] = [bend.map(onCircle), usual.map(onCircle)];
  const mixed = goal.map(([x, y], f) => {
    const [w, v, [p, q]] = [strength[f]!, weak[f]!, hint[f]!];
    return [w * x + v * p, w * y + v * q];
  });
  let angle = unwrapAngles(tridiagonal(all, stiffness, mixed).map(([x, y]) => Math.atan2(y!, x!)));
  for (let round = 0; round < 4; round += 1) {
    const off = ([x, y]: Complex, a: number) =>
      Math.atan2(y * Math.cos(a) - x * Math.sin(a), x * Math.cos(a) + y * Math.sin(a));
    const right = angle.map((a, f) => [all[f]! * a + strength[f]! * off(goal[f]!, a) + weak[f]! * off(hint[f]!, a)]);
    angle = tridiagonal(all, stiffness, right).map(([a]) => a!);
  }
  return angle;
}

function between(x: number, [low, high]: readonly [number, number]): number {
  return smoothstep((x - low) / (high - low));
}
