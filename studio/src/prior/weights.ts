/** `prior.json` and `prior.bin` as `tools/export_tab.py` writes them: what a page needs to draw motion. */

export interface Entry {
  readonly type: "float16" | "float32" | "int8";
  readonly shape: readonly number[];
  readonly at: number;
  /** Where the float16 scales of the rows begin, of what is stored in eight bits. */
  readonly scale?: number;
}

export interface Manifest {
  readonly format: number;
  /** SHA-256 of the weights, whoever stored them. */
  readonly weights: string;
  readonly name: string;
  readonly licence: string;
  readonly data: string;
  readonly fps: number;
  readonly net: {
    readonly features: number;
    readonly width: number;
    readonly layers: number;
    readonly heads: number;
    readonly patch: number;
  };
  readonly schedule: { readonly steps: number };
  readonly sampling: { readonly steps: number; readonly guidance: number; readonly late_guidance: number };
  readonly vocabulary: { readonly at: number; readonly bytes: number };
  readonly tensors: Readonly<Record<string, Entry>>;
  readonly graphs: Readonly<Record<string, { at: number; bytes: number; weights: readonly string[] }>>;
  readonly bytes: number;
  readonly sha256: string;
}

const FORMAT = 2;

export class Packed {
  constructor(
    readonly about: Manifest,
    private readonly data: ArrayBuffer,
  ) {
    if (about.format !== FORMAT)
      throw new Error(`the weights have the format ${about.format}, and this page reads ${FORMAT}; run make tab again`);
    if (data.byteLength !== about.bytes)
      throw new Error(`the weights have ${data.byteLength} bytes, not ${about.bytes}; load the page again`);
  }

  bytes({ at, bytes }: { at: number; bytes: number }): Uint8Array {
    return new Uint8Array(this.data, at, bytes);
  }

  /** The numbers of a tensor; `rows`: those of some rows alone, one behind the other. */
  tensor(name: string, rows?: readonly number[]): Float32Array {
    const { type, shape, at, scale } = this.about.tensors[name]!;
    const [count, size] = [shape[0]!, shape.slice(1).reduce((all, one) => all * one, 1)];
    if (type === "float32") return new Float32Array(this.data, at, count * size);
    const chosen = rows ?? Array.from({ length: count }, (_, row) => row);
    const result = new Float32Array(chosen.length * size);
    const halves = new Uint16Array(
      this.data,
      type === "float16" ? at : scale!,
      type === "float16" ? count * size : count,
    );
    const whole = new Int8Array(this.data, at, type === "int8" ? count * size : 0);
    chosen.forEach((row, n) => {
      const factor = type === "int8" ? HALF[halves[row]!]! : 1;
      for (let k = 0; k < size; k += 1)
        result[n * size + k] = type === "int8" ? whole[row * size + k]! * factor : HALF[halves[row * size + k]!]!;
    });
    return result;
  }

  /** The weights of a graph, one behind the other. */
  weightsOf(graph: string): Uint8Array {
    const parts = this.about.graphs[graph]!.weights.map((name) => this.tensor(name));
    const all = new Float32Array(parts.reduce((sum, part) => sum + part.length, 0));
    let at = 0;
    for (const part of parts) {
      all.set(part, at);
      at += part.length;
    }
    return new Uint8Array(all.buffer);
  }
}

/** Every number that 16 bits can be. */
const HALF = Float32Array.from({ length: 1 << 16 }, (_, bits) => {
  const [sign, power, rest] = [bits >> 15 ? -1 : 1, (bits >> 10) & 31, bits & 1023];
  if (power === 31) return rest ? NaN : sign * Infinity;
  return sign * (power ? 2 ** (power - 15) * (1 + rest / 1024) : 2 ** -14 * (rest / 1024));
});
