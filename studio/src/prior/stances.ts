/** What it takes that a foot stands in one place while its flags say that it stands (`motionloom.edits.stances`). */

import { type Vec, add, minus, norm, scaled, smoothstep } from "./turns";

/** Frames over which the change of a stance comes and goes where no other stance is near. */
const EASE = 6;
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
  const stances: [number, number][] = [];
  planted.forEach(([a, b], f) => {
    if (!a && !b) return;
    if (stances.at(-1)?.[1] === f) stances.at(-1)![1] += 1;
    else stances.push([f, f + 1]);
  });
  for (const [start, stop] of stances) {
    const own = path.slice(start, stop);
    const place = scaled(
      own.reduce<Vec>((sum, at) => add(sum, at), NONE),
      1 / own.length,
    );
    const away = own.map((at) => minus(at, place));
    const share = Math.min(1, FAR / Math.max(...away.map(norm), 1e-9));
    away.forEach((one, n) => (result[start + n] = scaled(one, share)));
  }
  between(result, stances);
  return result;
}

/** What leads from one stance to the next, in place; further than `EASE` from all stances it stays 0. */
function between(values: Vec[], stances: readonly (readonly [number, number])[]): void {
  if (!stances.length) return;
  const gaps = [...stances, null].map((next, n) => [stances[n - 1] ?? null, next] as const);
  for (const [last, next] of gaps) {
    const left = last ? last[1] - 1 : -EASE - 1;
    const right = next ? next[0] : values.length + EASE;
    const near = right - left <= 2 * EASE;
    const [leaving, coming] = [last ? values[left]! : NONE, next ? values[right]! : NONE];
    for (let f = Math.max(left + 1, 0); f < Math.min(right, values.length); f += 1) {
      const across = smoothstep((f - left) / (near ? right - left : EASE));
      const back = near ? across : 1 - smoothstep((right - f) / EASE);
      values[f] = add(scaled(leaving, 1 - across), coming, back);
    }
  }
}
