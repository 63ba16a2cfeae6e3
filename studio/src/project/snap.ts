/** Times that catch on what is near them. */

import { round, toFrame } from "./model";

/**
 * The nearest of `marks` within `reach` seconds, else the nearest frame.
 *
 * `off`: only frames (the user holds the key that turns snapping off).
 */
export function snap(time: number, marks: readonly number[], reach: number, off = false): number {
  let best = toFrame(time);
  if (off) return best;
  let distance = reach;
  for (const mark of marks) {
    const apart = Math.abs(mark - time);
    if (apart < distance) {
      distance = apart;
      best = round(mark);
    }
  }
  return best;
}

/** Whole and half seconds from 0 to `end`. */
export function halfSeconds(end: number): number[] {
  return Array.from({ length: Math.floor(end * 2) + 1 }, (_, index) => index / 2);
}
