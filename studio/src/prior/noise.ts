/**
 * Normal noise as NumPy makes it of a seed: `Generator(PCG64(seed)).standard_normal(dtype=float32)`, so that a seed
 * means the same motion here and in Python. Seeding as `SeedSequence`, PCG64 as of O'Neill 2014 (XSL RR), normals by
 * the ziggurat of Marsaglia and Tsang (2000) with 256 layers.
 */

const M32 = 0xffffffffn;
const M64 = 0xffffffffffffffffn;
const M128 = (1n << 128n) - 1n;
const MULTIPLIER = 0x2360ed051fc65da44385df649fccf645n;

/** The words of 32 bits of a whole number below 2^64, as few as it has. */
const wordsOf = (number: bigint): number[] =>
  [number, number >> 32n].slice(0, number > M32 ? 2 : 1).map((x) => Number(x & M32));

/** A seed for one more try of what has a seed (`motionloom.core.diffusion.sampling.row_seed`). */
export function rowSeed(seed: number, number: number): bigint {
  const [low, high] = seeded([...wordsOf(BigInt(seed)), number, 0]).map(BigInt) as [bigint, bigint];
  return (((high << 32n) | low) >> 1n) & ((1n << 62n) - 1n);
}

/** Eight words of 32 bits out of at most four. */
function seeded(words: readonly number[]): number[] {
  let hash = 0x43b0d7e5;
  const hashed = (value: number): number => {
    let x = (value ^ hash) >>> 0;
    hash = Math.imul(hash, 0x931e8875) >>> 0;
    x = Math.imul(x, hash) >>> 0;
    return (x ^ (x >>> 16)) >>> 0;
  };
  const mixed = (a: number, b: number): number => {
    const x = (Math.imul(a, 0xca01f9dd) - Math.imul(b, 0x4973f715)) >>> 0;
    return (x ^ (x >>> 16)) >>> 0;
  };
  const pool = [0, 1, 2, 3].map((n) => hashed(words[n] ?? 0));
  for (let from = 0; from < 4; from += 1)
    for (let to = 0; to < 4; to += 1) if (from !== to) pool[to] = mixed(pool[to]!, hashed(pool[from]!));
  let state = 0x8b51f9dd;
  return Array.from({ length: 8 }, (_, n) => {
    let x = (pool[n % 4]! ^ state) >>> 0;
    state = Math.imul(state, 0x58f38ded) >>> 0;
    x = Math.imul(x, state) >>> 0;
    return (x ^ (x >>> 16)) >>> 0;
  });
}

/** Where the layers of the ziggurat end. */
const [R, AREA] = [3.6541528853610088, 0.00492867323399];
const [WIDE, HIGH, INSIDE] = ziggurat();

function ziggurat(): [Float32Array, Float32Array, Float64Array] {
  const [wide, high, inside] = [new Float32Array(256), new Float32Array(256), new Float64Array(256)];
  const scale = 2 ** 23;
  let [x, before] = [R, R];
  const bottom = AREA / Math.exp(-0.5 * R * R);
  [inside[0], inside[1]] = [Math.floor((R / bottom) * scale), 0];
  [wide[0], wide[255]] = [bottom / scale, R / scale];
  [high[0], high[255]] = [1, Math.exp(-0.5 * R * R)];
  for (let n = 254; n > 0; n -= 1) {
    x = Math.sqrt(-2 * Math.log(AREA / x + Math.exp(-0.5 * x * x)));
    inside[n + 1] = Math.floor((x / before) * scale);
    before = x;
    [high[n], wide[n]] = [Math.exp(-0.5 * x * x), x / scale];
  }
  return [wide, high, inside];
}

export class Noise {
  private state: bigint;
  private readonly step: bigint;
  private spare: number | null = null;

  /** A whole seed from 0 to 2^64. */
  constructor(seed: bigint) {
    const words = seeded(wordsOf(seed)).map(BigInt);
    const [a, b, c, d] = [0, 2, 4, 6].map((n) => words[n]! | (words[n + 1]! << 32n)) as [
      bigint,
      bigint,
      bigint,
      bigint,
    ];
    this.step = ((((c << 64n) | d) << 1n) | 1n) & M128;
    this.state = (this.step + ((a << 64n) | b)) & M128;
    this.state = (this.state * MULTIPLIER + this.step) & M128;
  }

  /** So many numbers of mean 0 and standard deviation 1. */
  normals(count: number): Float32Array {
    const result = new Float32Array(count);
    for (let n = 0; n < count; n += 1) result[n] = this.normal();
    return result;
  }

  private word(): number {
    if (this.spare !== null) {
      const word = this.spare;
      this.spare = null;
      return word;
    }
    this.state = (this.state * MULTIPLIER + this.step) & M128;
    const [mixed, turn] = [((this.state >> 64n) ^ this.state) & M64, this.state >> 122n];
    const out = ((mixed >> turn) | (mixed << (64n - turn))) & M64;
    this.spare = Number(out >> 32n);
    return Number(out & M32);
  }

  private share(): number {
    return (this.word() >>> 8) / 2 ** 24;
  }

  private normal(): number {
    for (;;) {
      const word = this.word();
      const [layer, sign, whole] = [word & 255, (word >>> 8) & 1 ? -1 : 1, (word >>> 9) & 0x7fffff];
      const x = Math.fround(whole * WIDE[layer]!);
      if (whole < INSIDE[layer]!) return sign * x;
      if (layer === 0) {
        for (;;) {
          const far = Math.fround(-Math.log1p(-this.share()) / R);
          const high = Math.fround(-Math.log1p(-this.share()));
          if (high + high > far * far) return ((whole >>> 8) & 1 ? -1 : 1) * Math.fround(R + far);
        }
      }
      if ((HIGH[layer - 1]! - HIGH[layer]!) * this.share() + HIGH[layer]! < Math.exp(-0.5 * x * x)) return sign * x;
    }
  }
}
