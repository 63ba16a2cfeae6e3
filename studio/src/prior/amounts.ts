/** Numbers in words as what is drawn: lengths, ways of the pelvis, strokes one after the other (`motionloom.goals.amounts`). */

import type { Place, Way } from "./path";
import { FASTEST, between } from "./path";
import { sums, unwrapAngles } from "./dense";
import { LEFT, RIGHT } from "./person";
import { type Vec, clip, rounded } from "./turns";
import { type Amount, RADIUS, described, isSeveral, once, readAmount, readSeconds } from "./words";
import tables from "./words.json";

/** Seconds of standing around a way or a turn, and of setting out and stopping. */
const [BEFORE, AFTER, RAMP] = [0.3, 0.6, 0.4];
/** Degrees per second on the spot; share of the pace of the words that a way may be slowed to. */
const [TURNING, SLOWEST] = [75, 0.5];
/** Seconds from which on a stroke is a segment of its own; quicker ones follow each other in one. */
const CHAINED = 1.4;
/** Seconds over which one segment becomes the next. */
export const TRANSITION = 1;

/** What is drawn as one row of the network. */
export interface Part {
  readonly text: string;
  readonly seconds: number;
  /** Seconds shared with the next one. */
  readonly transition: number;
  /** Seen from where the person is when it begins; null: wherever the network goes. */
  readonly way: Way | null;
}

/**
 * The number in the words of a sentence, and how long they take by them; nulls without, where that is too long, and
 * where the sentence says several things one after the other, which Python parts and this page does not.
 */
export interface Reading {
  readonly amount: Amount | null;
  readonly seconds: number | null;
}

export function reading(text: string, fps: number, longest: number): Reading {
  if (isSeveral(text)) return { amount: null, seconds: null };
  const [amountInText, explicit] = [readAmount(text), readSeconds(text)];
  const amount = amountInText && secondsFor(amountInText, fps) <= longest ? amountInText : null;
  const seconds = explicit ?? (amount && secondsFor(amount, fps));
  return { amount, seconds: seconds && Math.min(seconds, longest) };
}

/** How long it takes at the pace of the words, standing before and after. */
export function secondsFor(amount: Amount, fps: number): number {
  if (amount.kind === "count") {
    const stroke = tables.strokes[amount.of!];
    return amount.size * stroke + (stroke < CHAINED ? 0.5 : 0);
  }
  const moving = amount.kind === "turn" ? amount.size / TURNING : amount.metres / amount.speed;
  return rounded((BEFORE + moving + RAMP + AFTER) * fps) / fps;
}

/** A sentence as what is drawn of it: with its number, or as it is; `share`: of the way of steps, if that needs another. */
export function partsOf(text: string, seconds: number, amount: Amount | null, fps: number, share = 1): Part[] {
  const whole = { text, seconds, transition: TRANSITION, way: null };
  if (!amount) return [whole];
  if (amount.kind !== "count") {
    const asked = amount.kind === "steps" ? { ...amount, metres: amount.metres * share } : amount;
    return [{ ...whole, way: wayFor(asked, seconds, fps) }];
  }
  const [stroke, single] = [tables.strokes[amount.of!], once(text)];
  const frames = (length: number): number => Math.max(1, rounded(length * fps));
  const way = (length: number): Way | null =>
    amount.inPlace ? { places: Array.from({ length }, (): Place => [0, 0]), facing: null } : null;
  if (stroke < CHAINED) return [{ ...whole, text: single, seconds: frames(seconds) / fps, way: way(frames(seconds)) }];
  const each = frames(Math.min(stroke, seconds / amount.size)) / fps;
  const part = {
    text: single,
    seconds: each,
    transition: Math.min(TRANSITION, each / 2),
    way: way(rounded(each * fps)),
  };
  return Array.from({ length: amount.size }, () => part);
}

/** Where the pelvis goes and how it faces, for one action of so many seconds. */
export function wayFor(amount: Amount, seconds: number, fps: number): Way {
  if (amount.metres > FASTEST * seconds)
    throw new Error(`nobody runs ${amount.metres} m in ${seconds.toFixed(1)} s; make the sentence longer`);
  const share = shares(rounded(seconds * fps), seconds, secondsFor(amount, fps), fps);
  const side = amount.direction === "left" ? 1 : -1;
  const degrees = (amount.size * Math.PI) / 180;
  if (amount.kind === "turn")
    return { places: share.map((): Place => [0, 0]), facing: share.map((u) => side * degrees * u), free: true };
  if (amount.kind === "arc") {
    const ahead = amount.backward ? -1 : 1;
    const places = share.map((u): Place => [
      side * RADIUS * (1 - Math.cos(degrees * u)),
      ahead * RADIUS * Math.sin(degrees * u),
    ]);
    return { places, facing: share.map((u) => side * ahead * degrees * u) };
  }
  const [x, z] = { forward: [0, 1], backward: [0, -1], left: [1, 0], right: [-1, 0] }[amount.direction] as [
    number,
    number,
  ];
  return {
    places: share.map((u): Place => [amount.metres * u * x, amount.metres * u * z]),
    facing: share.map(() => 0),
  };
}

/** From 0 to 1: the share of a way that is behind one, setting out and stopping softly. */
function shares(frames: number, seconds: number, natural: number, fps: number): number[] {
  const rest = Math.min(1, seconds / natural);
  const lasting = Math.min((natural - BEFORE - AFTER) / SLOWEST, seconds - rest * (BEFORE + AFTER));
  const ramp = Math.min(RAMP, lasting / 2);
  const fine = Array.from({ length: 512 }, (_, n) => (n * lasting) / 511);
  const speed = fine.map((at) => Math.min(1, Math.min(at, lasting - at) / ramp));
  const gone = sums(speed.slice(1).map((one, n) => (one + speed[n]!) / 2));
  return Array.from({ length: frames }, (_, f) => {
    const at = clip(f / fps - rest * BEFORE, 0, lasting);
    return between(at, fine, gone) / gone.at(-1)!;
  });
}

/** Degrees (10 of a full turn), and share of a way, by which a motion may miss what was read. */
const [TURN_OFF, WAY_OFF] = [10, 0.1];
/** Metres between the places of a foot before and after a step; metres per second of a foot that is down. */
const [STEP, DOWN] = [0.15, 0.35];

/** The share of its way with which steps are tried again of which so many were made. */
export function nextShare(share: number, asked: number, made: number): number {
  return clip(share * clip(Math.sqrt(asked / Math.max(made, 0.5)), 0.75, 1.35), 0.5, 2);
}

/** A sentence where what was `measured` misses a number; empty where it keeps to it. */
export function missed(amount: Amount, found: number): string {
  const { kind, size } = amount;
  const isTurn = kind === "turn" || kind === "arc";
  const off = Math.abs(found - size);
  if (isTurn ? off <= Math.max(TURN_OFF, size / 36) : kind === "way" ? off <= WAY_OFF * size : !off) return "";
  const unit = isTurn ? "degrees" : kind === "way" ? "m" : "steps";
  return `${described(amount)} asked; ${found.toFixed(kind === "way" ? 2 : 0)} ${unit} drawn`;
}

/** Degrees turned to the side that was said, metres gone, or steps; strokes nobody counts. */
export function measured(amount: Amount, places: readonly (readonly Vec[])[], fps: number): number {
  const { kind, direction, backward } = amount;
  if (kind === "count") return amount.size;
  const [first, last] = [places[0]!, places.at(-1)!];
  if (kind === "way") return Math.hypot(last[0]![0] - first[0]![0], last[0]![2] - first[0]![2]);
  if (kind === "steps") {
    const sides = direction === "left" ? [LEFT] : direction === "right" ? [RIGHT] : [LEFT, RIGHT];
    return sides.reduce(
      (sum, { foot }) =>
        sum +
        moves(
          places.map((at) => at[foot]!),
          fps,
        ),
      0,
    );
  }
  const facing = unwrapAngles(
    places.map((at) => {
      const wide = (axis: 0 | 2): number =>
        [LEFT, RIGHT].reduce(
          (sum, { hip, shoulder }, n) => sum + (n ? -1 : 1) * (at[hip]![axis] + at[shoulder]![axis]),
          0,
        );
      return Math.atan2(-wide(2), wide(0));
    }),
  );
  const side = (direction === "left") !== (kind === "arc" && backward) ? 1 : -1;
  return (side * (facing.at(-1)! - facing[0]!) * 180) / Math.PI;
}

/** How often a foot is put down away from where it was. */
function moves(foot: readonly Vec[], fps: number): number {
  const apart = (a: Vec, b: Vec): number => Math.hypot(a[0] - b[0], a[2] - b[2]);
  let [where, count] = [foot[0]!, 0];
  foot.forEach((place, f) => {
    const [a, b] = [Math.max(f - 1, 0), Math.min(f + 1, foot.length - 1)];
    if ((apart(foot[b]!, foot[a]!) / (b - a)) * fps >= DOWN || apart(place, where) <= STEP) return;
    [where, count] = [place, count + 1];
  });
  return count;
}
