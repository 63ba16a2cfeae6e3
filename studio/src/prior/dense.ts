/** Small dense matrices of float64, row behind row. */

/** Solve a x = right for symmetric positive a (size * size) and each of `columns` columns of right; by Cholesky. */
export function solveSystem(a: Float64Array, right: Float64Array, size: number, columns: number): Float64Array {
  const lower = a.slice();
  for (let i = 0; i < size; i += 1) {
    for (let j = 0; j <= i; j += 1) {
      let sum = lower[i * size + j]!;
      for (let k = 0; k < j; k += 1) sum -= lower[i * size + k]! * lower[j * size + k]!;
      lower[i * size + j] = i === j ? Math.sqrt(sum) : sum / lower[j * size + j]!;
    }
  }
  const x = right.slice();
  const eliminate = (i: number, k: number, by: number): void => {
    for (let c = 0; c < columns; c += 1) x[i * columns + c]! -= by * x[k * columns + c]!;
  };
  const divide = (i: number): void => {
    for (let c = 0; c < columns; c += 1) x[i * columns + c]! /= lower[i * size + i]!;
  };
  for (let i = 0; i < size; i += 1) {
    for (let k = 0; k < i; k += 1) eliminate(i, k, lower[i * size + k]!);
    divide(i);
  }
  for (let i = size - 1; i >= 0; i -= 1) {
    for (let k = i + 1; k < size; k += 1) eliminate(i, k, lower[k * size + i]!);
    divide(i);
  }
  return x;
}

/** A matrix (rows, values.length) times values. */
export function product(matrix: Float64Array, values: ArrayLike<number>): number[] {
  const width = values.length;
  return Array.from({ length: width ? matrix.length / width : 0 }, (_, row) => {
    let sum = 0;
    for (let k = 0; k < width; k += 1) sum += matrix[row * width + k]! * values[k]!;
    return sum;
  });
}

/** (size, size) of how near two frames are: 1 on the diagonal, a bell of that width in frames beside it. */
export function bell(size: number, width: number): Float64Array {
  return Float64Array.from({ length: size * size }, (_, n) => {
    const lag = (Math.floor(n / size) - (n % size)) / width;
    return Math.exp(-0.5 * lag * lag);
  });
}

/** Angles without jumps of more than half a turn. */
export function unwrapAngles(angles: readonly number[]): number[] {
  const whole = 2 * Math.PI;
  let turns = 0;
  return angles.map((angle, n) => {
    if (n) turns -= Math.round((angle - angles[n - 1]!) / whole) * whole;
    return angle + turns;
  });
}

/** Sums up to each number, with a zero before them. */
export function sums(numbers: readonly number[]): number[] {
  const result = [0];
  for (const one of numbers) result.push(result.at(-1)! + one);
  return result;
}
