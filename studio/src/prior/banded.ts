/** Least squares in time: dense blocks per frame, and smoothness between frames. */

import { solveSystem } from "./dense";

/**
 * Diagonal, first and second off-diagonal of the squared second differences of what is asked per frame, times size²;
 * it is 0 outside where there are frames `before` or `after`.
 */
export function bending(size: number, frames: number, before: boolean, after: boolean): Float64Array[] {
  const bands = [0, 1, 2].map(() => new Float64Array(frames));
  const pattern = [1, -2, 1];
  for (let row = before ? -2 : 0; row < frames - (after ? 0 : 2); row += 1) {
    pattern.forEach((a, i) =>
      pattern.slice(i).forEach((b, k) => {
        if (row + i >= 0 && row + i + k < frames) bands[k]![row + i]! += size ** 2 * a * b;
      }),
    );
  }
  return bands;
}

/** Solve (blocks + 1 + bands) x = right: blocks (n, n) per frame, bands between frames; two frames at a time (Thomas). */
export function banded(
  blocks: readonly Float64Array[],
  right: Float64Array,
  bands: readonly Float64Array[],
  n: number,
): Float64Array {
  const [frames, size] = [blocks.length, 2 * n];
  const count = Math.ceil(frames / 2);
  const x = new Float64Array(count * size);
  x.set(right);
  /** What couples frame `f` with the one `gap` behind it. */
  const link = (f: number, gap: number): number => (f + gap < frames && gap < 3 ? bands[gap]![f]! : 0);
  const gains: Float64Array[] = [];
  for (let k = 0; k < count; k += 1) {
    const main = new Float64Array(size * size);
    for (let s = 0; s < 2; s += 1) {
      const f = 2 * k + s;
      for (let i = 0; i < n; i += 1) {
        const row = (s * n + i) * size;
        if (f < frames) main.set(blocks[f]!.subarray(i * n, i * n + n), row + s * n);
        main[row + s * n + i]! += f < frames ? 1 + bands[0]![f]! : 1;
        main[row + (1 - s) * n + i]! += link(2 * k, 1);
      }
    }
    const before = gains[k - 1];
    for (let t = 0; before && t < 2; t += 1) {
      for (let s = 0; s < 2; s += 1) {
        const couple = link(2 * k - 2 + s, 2 + t - s);
        if (!couple) continue;
        for (let i = 0; i < n; i += 1) {
          const [to, from] = [t * n + i, s * n + i];
          for (let j = 0; j < size; j += 1) main[to * size + j]! -= couple * before[from * size + j]!;
          x[k * size + to]! -= couple * x[(k - 1) * size + from]!;
        }
      }
    }
    const sides = new Float64Array(size * (size + 1));
    for (let i = 0; i < size; i += 1) {
      const [s, c] = [Math.floor(i / n), i % n];
      for (let t = 0; t < 2; t += 1) sides[i * (size + 1) + t * n + c] = link(2 * k + s, 2 + t - s);
      sides[i * (size + 1) + size] = x[k * size + i]!;
    }
    const found = solveSystem(main, sides, size, size + 1);
    const gain = new Float64Array(size * size);
    for (let i = 0; i < size; i += 1) {
      gain.set(found.subarray(i * (size + 1), i * (size + 1) + size), i * size);
      x[k * size + i] = found[i * (size + 1) + size]!;
    }
    gains.push(gain);
  }
  for (let k = count - 2; k >= 0; k -= 1) {
    for (let i = 0; i < size; i += 1) {
      let sum = 0;
      for (let j = 0; j < size; j += 1) sum += gains[k]![i * size + j]! * x[(k + 1) * size + j]!;
      x[k * size + i]! -= sum;
    }
  }
  return x.subarray(0, frames * n);
}
