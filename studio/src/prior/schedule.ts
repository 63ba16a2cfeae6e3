/** Noise levels and the moves between them: the cosine schedule, spaced densely near pure noise, and DDPM. */

import { rounded } from "./turns";

export interface Schedule {
  /** Shares of signal and noise of each level; level 0 is clean. */
  readonly signal: readonly number[];
  readonly noise: readonly number[];
}

/** Nichol and Dhariwal 2021, eq. 17, with betas cut at 0.999. */
export function cosine(steps: number): Schedule {
  const alphaBar = (u: number): number => Math.cos((((u + 0.008) / 1.008) * Math.PI) / 2) ** 2;
  const bars = [1];
  for (let n = 0; n < steps; n += 1) {
    const beta = Math.min(Math.max(1 - alphaBar((n + 1) / steps) / alphaBar(n / steps), 0), 0.999);
    bars.push(bars[n]! * (1 - beta));
  }
  return { signal: bars.map(Math.sqrt), noise: bars.map((bar) => Math.sqrt(1 - bar)) };
}

/** Falling levels from the noisiest one to 0, `steps` moves. */
export function levels(top: number, steps: number): number[] {
  const result = [top];
  for (let n = 1; n < steps; n += 1) {
    const wanted = top * (1 - (n / steps) ** 2);
    result.push(Math.max(Math.min(rounded(wanted), result[n - 1]! - 1), steps - n));
  }
  return [...result, 0];
}

/** Guidance at a level: what it adds to 1 is `late` times as much below a tenth of all levels, as much above three. */
export function guidanceAt(level: number, steps: number, scale: number, late: number): number {
  const share = Math.min(Math.max(1.5 - (5 * level) / steps, 0), 1);
  return scale + Math.max(scale - 1, 0) * (late - 1) * share;
}

/** Factors of the estimate, the state and fresh noise in the move from level t to s (Ho et al. 2020, eq. 7). */
export function move({ signal, noise }: Schedule, t: number, s: number): readonly [number, number, number] {
  const r = (signal[t]! * noise[s]!) / (signal[s]! * noise[t]!);
  const carried = (noise[s]! * r) / noise[t]!;
  return [signal[s]! - carried * signal[t]!, carried, noise[s]! * Math.sqrt(1 - r * r)];
}
