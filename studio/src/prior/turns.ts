/** Vectors and unit quaternions (w, x, y, z), as `motionloom.core.rotations` has them. */

export type Vec = readonly [number, number, number];
export type Turn = readonly [number, number, number, number];

export const IDENTITY: Turn = [1, 0, 0, 0];

export const add = (a: Vec, b: Vec, share = 1): Vec => [a[0] + share * b[0], a[1] + share * b[1], a[2] + share * b[2]];
export const minus = (a: Vec, b: Vec): Vec => add(a, b, -1);
export const scaled = (a: Vec, by: number): Vec => [a[0] * by, a[1] * by, a[2] * by];
export const dot = (a: Vec, b: Vec): number => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const norm = (a: Vec): number => Math.sqrt(dot(a, a));
export const unit = (a: Vec): Vec => scaled(a, 1 / Math.max(norm(a), 1e-9));
export const clip = (x: number, low: number, high: number): number => Math.min(Math.max(x, low), high);

export function cross(a: Vec, b: Vec): Vec {
  return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
}

/** Unit part of `v` across the unit vector `to`; any one where there is none. */
export function across(v: Vec, to: Vec): Vec {
  const part = add(v, to, -dot(v, to));
  return unit(norm(part) > 1e-9 ? part : cross(to, other(to)));
}

/** An axis that is not near to a unit vector. */
export function other(v: Vec): Vec {
  return Math.abs(v[0]) < 0.9 ? [1, 0, 0] : [0, 1, 0];
}

/** As Python rounds: halves to the even number. */
export function rounded(x: number): number {
  const near = Math.round(x);
  return Math.abs(x % 1) === 0.5 && near % 2 ? near - 1 : near;
}

/** From 0 to 1 without slope at both ends. */
export function smoothstep(u: number): number {
  const at = clip(u, 0, 1);
  return at * at * (3 - 2 * at);
}

/** First turn by b, then by a. */
export function times(a: Turn, b: Turn): Turn {
  const [p, q]: [Vec, Vec] = [
    [a[1], a[2], a[3]],
    [b[1], b[2], b[3]],
  ];
  const v = add(add(scaled(q, a[0]), p, b[0]), cross(p, q));
  return [a[0] * b[0] - dot(p, q), ...v];
}

export const inverse = (q: Turn): Turn => [q[0], -q[1], -q[2], -q[3]];

export function rotate(q: Turn, v: Vec): Vec {
  const axis: Vec = [q[1], q[2], q[3]];
  const t = scaled(cross(axis, v), 2);
  return add(add(v, t, q[0]), cross(axis, t));
}

export function normalized(q: readonly number[]): Turn {
  const length = Math.hypot(...q);
  return length > 1e-12 ? (q.map((x) => x / length) as unknown as Turn) : IDENTITY;
}

/** The smallest turn from the direction of a to that of b. */
export function shortestArc(from: Vec, to: Vec): Turn {
  const [a, b] = [scaled(from, 1 / Math.max(norm(from), 1e-12)), scaled(to, 1 / Math.max(norm(to), 1e-12))];
  const w = 1 + dot(a, b);
  return normalized(w < 1e-8 ? [0, ...cross(a, other(a))] : [w, ...cross(a, b)]);
}

/** From a to b along the shorter way. */
export function slerp(a: Turn, b: Turn, amount: number): Turn {
  const way = times(inverse(a), b);
  const sign = way[0] > 0 ? 1 : -1;
  const axis: Vec = [sign * way[1], sign * way[2], sign * way[3]];
  return normalized(times(a, aboutAxis(unit(axis), 2 * amount * Math.atan2(norm(axis), sign * way[0]))));
}

/** By an angle in radians about a unit vector. */
export function aboutAxis(axis: Vec, angle: number): Turn {
  return [Math.cos(angle / 2), ...scaled(axis, Math.sin(angle / 2))];
}

/** Of the rotation matrix with these columns (Markley 2008). */
export function ofColumns(a: Vec, b: Vec, c: Vec): Turn {
  const [x, y, z] = [a[0], b[1], c[2]];
  const [wx, wy, wz] = [b[2] - c[1], c[0] - a[2], a[1] - b[0]];
  const [xy, yz, zx] = [b[0] + a[1], c[1] + b[2], a[2] + c[0]];
  const rows = [
    [1 + x + y + z, wx, wy, wz],
    [wx, 1 + x - y - z, xy, zx],
    [wy, xy, 1 + y - z - x, yz],
    [wz, zx, yz, 1 + z - x - y],
  ];
  let best = 0;
  for (let n = 1; n < 4; n += 1) if (rows[n]![n]! > rows[best]![best]!) best = n;
  return normalized(rows[best]!);
}

/** Signs flipped in place so that neighbouring frames lie in the same half of the sphere. */
export function unroll(turns: Turn[]): Turn[] {
  for (let f = 1; f < turns.length; f += 1) {
    const [a, b] = [turns[f - 1]!, turns[f]!];
    if (a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3] < 0) turns[f] = [-b[0], -b[1], -b[2], -b[3]];
  }
  return turns;
}

/** Eigenvalues and, in rows, eigenvectors of a small symmetric matrix, the largest first (Jacobi). */
export function eigen(matrix: readonly (readonly number[])[]): { value: number; vector: number[] }[] {
  const size = matrix.length;
  const a = matrix.map((row) => [...row]);
  const v: number[][] = a.map((_, i) => a.map((__, j) => (i === j ? 1 : 0)));
  for (let sweep = 0; sweep < 16; sweep += 1) {
    for (let p = 0; p < size; p += 1) {
      for (let q = p + 1; q < size; q += 1) {
        if (Math.abs(a[p]![q]!) < 1e-300) continue;
        const theta = (a[q]![q]! - a[p]![p]!) / (2 * a[p]![q]!);
        const t = (theta < 0 ? -1 : 1) / (Math.abs(theta) + Math.hypot(theta, 1));
        const c = 1 / Math.hypot(t, 1);
        const s = t * c;
        for (let k = 0; k < size; k += 1) {
          const [x, y] = [a[k]![p]!, a[k]![q]!];
          [a[k]![p], a[k]![q]] = [c * x - s * y, s * x + c * y];
        }
        for (let k = 0; k < size; k += 1) {
          const [x, y] = [a[p]![k]!, a[q]![k]!];
          [a[p]![k], a[q]![k]] = [c * x - s * y, s * x + c * y];
          const [m, n] = [v[p]![k]!, v[q]![k]!];
          [v[p]![k], v[q]![k]] = [c * m - s * n, s * m + c * n];
        }
      }
    }
  }
  return v.map((vector, i) => ({ value: a[i]![i]!, vector })).sort((x, y) => y.value - x.value);
}

/** Solve (diagonal + stiffness * path Laplacian) x = right for each column (Thomas); rows are frames. */
export function tridiagonal(
  weights: readonly number[],
  stiffness: number,
  right: readonly (readonly number[])[],
): number[][] {
  const frames = right.length;
  const diagonal = weights.map((w, f) => w + stiffness * (Number(f > 0) + Number(f < frames - 1)));
  const x = right.map((row) => [...row]);
  const ratio = new Array<number>(frames).fill(0);
  x[0] = x[0]!.map((value) => value / diagonal[0]!);
  for (let f = 1; f < frames; f += 1) {
    ratio[f - 1] = -stiffness / diagonal[f - 1]!;
    diagonal[f]! += stiffness * ratio[f - 1]!;
    x[f] = x[f]!.map((value, k) => (value + stiffness * x[f - 1]![k]!) / diagonal[f]!);
  }
  for (let f = frames - 2; f >= 0; f -= 1) x[f] = x[f]!.map((value, k) => value - ratio[f]! * x[f + 1]![k]!);
  return x;
}
