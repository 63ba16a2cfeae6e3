/** What it takes that a foot stands in one place while its flags say that it stands (`motionloom.edits.stances`). */

import { type Span, spans } from "./feet";
import { type Vec, add, minus, norm, scaled, smoothstep } from "./turns";

/** Frames over which the change of a stance comes and goes where no other stance is near. */
const EASE = 6;
/** Frames before the first stance and after the last over which a foot comes back to going with the body. */
const BEYOND = 30;
/** Metres that a standing foot is moved at most. */
const FAR = 0.12;
const NONE: Vec = [0, 0, 0];

/** Metres, horizontal, to add to a foot in each frame; `planted` are the flags of ankle and toe. */
export function stilled(
  ankle: readonly Vec[],
  toe: readonly Vec[],
  planted: readonly (readonly [boolean, boolean])[],
): Vec[] {
  const path: Vec[] = [NONE];
  for (let f = 1; f < ankle.length; f += 1) {
    const both = (k: 0 | 1): boolean => planted[f]![k] && planted[f - 1]![k];
    const step = both(1) ? minus(toe[f - 1]!, toe[f]!) : both(0) ? minus(ankle[f - 1]!, ankle[f]!) : NONE;
    path.push(add(path[f - 1]!, [step[0], 0, step[2]]));
  }
  const result = path.map(() => NONE);
  const stances = spans(planted.map(([a, b]) => a || b));
  for (const [start, stop] of stances) {
    const own = path.slice(start, stop);
    const place = mean(own);
    const away = own.map((at) => minus(at, place));
    const share = Math.min(1, FAR / Math.max(...away.map(norm), 1e-9));
    away.forEach((one, n) => (result[start + n] = scaled(one, share)));
  }
  between(result, stances, EASE);
  return result;
}

/** Metres that a foot goes when the body goes by `shift`: through every stance by the mean of it. */
export function carried(shift: readonly Vec[], standing: readonly boolean[]): Vec[] {
  const extra = shift.map(() => NONE);
  const stances = spans(standing);
  for (const [start, stop] of stances) {
    const middle = mean(shift.slice(start, stop));
    for (let f = start; f < stop; f += 1) extra[f] = minus(middle, shift[f]!);
  }
  between(extra, stances, BEYOND);
  return shift.map((way, f) => add(way, extra[f]!));
}

const mean = (all: readonly Vec[]): Vec =>
  scaled(
    all.reduce<Vec>((sum, at) => add(sum, at), NONE),
    1 / all.length,
  );

/** What leads from one stance to the next, in place; further than `ease` frames from all stances it stays 0. */
function between(values: Vec[], stances: readonly Span[], ease: number): void {
  if (!stances.length) return;
  const gaps = [...stances, null].map((next, n) => [stances[n - 1] ?? null, next] as const);
  for (const [last, next] of gaps) {
    const left = last ? last[1] - 1 : -ease - 1;
    const right = next ? next[0] : values.length + ease;
    const near = right - left <= 2 * ease;
    const [leaving, coming] = [last ? values[left]! : NONE, next ? values[right]! : NONE];
    for (let f = Math.max(left + 1, 0); f < Math.min(right, values.length); f += 1) {
      const across = smoothstep((f - left) / (near ? right - left : ease));
      const back = near ? across : 1 - smoothstep((right - f) / ease);
      values[f] = add(scaled(leaving, 1 - across), coming, back);
    }
  }
}
