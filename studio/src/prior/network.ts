/** The networks as sessions of ONNX Runtime: words to what the prior is asked, noisy states to denoised ones. */

import type { InferenceSession, Tensor, TypedTensor } from "onnxruntime-common";
import type { Packed } from "./weights";
import { WordPiece } from "./wordpiece";

/** What is used of ONNX Runtime, whichever build of it. */
export interface Runtime {
  readonly Tensor: typeof Tensor;
  readonly InferenceSession: {
    create(graph: Uint8Array, options: InferenceSession.SessionOptions): Promise<InferenceSession>;
  };
}

/** A text as the layers of the prior want it. */
export interface Condition {
  /** (width) */
  readonly text: Float32Array;
  /** (layers, heads, words, head width) */
  readonly keys: Float32Array;
  readonly values: Float32Array;
  readonly words: number;
}

/** A row of a call: (frames * features) standardised, its level, and what it is asked. */
export interface Row {
  readonly state: Float32Array;
  readonly level: number;
  readonly asked: Condition;
}

type Numbers = TypedTensor<"float32">;
type Graph = "text" | "bind" | "prior";

/** What computes has failed, whatever it was given. */
export class Failed extends Error {}

export class Network {
  private readonly pieces: WordPiece;
  private readonly nothing: Promise<Condition>;
  /** The call that was made last. */
  private last: Promise<unknown> = Promise.resolve();

  private constructor(
    private readonly ort: Runtime,
    readonly packed: Packed,
    private readonly sessions: Record<Graph, InferenceSession>,
    readonly graphics: boolean,
  ) {
    this.pieces = new WordPiece(new TextDecoder().decode(packed.bytes(packed.about.vocabulary)));
    const width = packed.about.tensors["text.places.weight"]!.shape[1]!;
    this.nothing = this.bound(new Float32Array(width), new Float32Array(width), 1);
  }

  /** `graphics`: the large graph runs on WebGPU, which the runtime must know; the small ones never do. */
  static async open(ort: Runtime, packed: Packed, graphics = false): Promise<Network> {
    const open = (name: Graph): Promise<InferenceSession> =>
      ort.InferenceSession.create(packed.bytes(packed.about.graphs[name]!), {
        logSeverityLevel: 3,
        ...(graphics && { executionProviders: [name === "prior" ? "webgpu" : "wasm"] }),
        externalData: [{ path: "weights", data: packed.weightsOf(name) }],
      });
    const sessions = { text: await open("text"), bind: await open("bind"), prior: await open("prior") };
    return new Network(ort, packed, sessions, graphics);
  }

  tokens(text: string): number[] {
    return this.pieces.encode(text);
  }

  /** What the prior is asked with a text; an empty one asks for nothing in particular. */
  async ask(text: string): Promise<Condition> {
    if (!text.trim()) return this.nothing;
    const ids = this.tokens(text);
    const pieces = this.packed.tensor("text.words.weight", ids);
    const places = this.packed.tensor("text.places.weight");
    pieces.forEach((value, n) => (pieces[n] = value + places[n]!));
    const width = pieces.length / ids.length;
    const { states } = await this.run("text", {
      pieces: this.floats(pieces, [1, ids.length, width]),
      mask: this.flags(
        ids.map(() => true),
        [1, ids.length],
      ),
    });
    const tokens = (states as Numbers).data;
    const mean = Float32Array.from({ length: width }, (_, k) => {
      let sum = 0;
      for (let n = k; n < tokens.length; n += width) sum += tokens[n]!;
      return sum / ids.length;
    });
    const size = Math.max(Math.hypot(...mean), 1e-12);
    return this.bound(
      mean.map((value) => value / size),
      tokens,
      ids.length,
    );
  }

  private async bound(pooled: Float32Array, tokens: Float32Array, words: number): Promise<Condition> {
    const { text, keys, values } = (await this.run("bind", {
      pooled: this.floats(pooled, [1, pooled.length]),
      tokens: this.floats(tokens, [1, words, pooled.length]),
    })) as Record<string, Numbers>;
    return { text: text!.data, keys: keys!.data, values: values!.data, words };
  }

  /** Clean states of rows, guided by their texts: u + scale (c - u). */
  async guided(rows: readonly Row[], scale: number): Promise<Float32Array[]> {
    const nothing = await this.nothing;
    const made = await this.denoised([...rows, ...rows.map((row) => ({ ...row, asked: nothing }))]);
    return rows.map((_, n) => {
      const [asked, free] = [made[n]!, made[n + rows.length]!];
      return asked.map((value, k) => value - (1 - scale) * (value - free[k]!));
    });
  }

  /** One call of the network. */
  private async denoised(rows: readonly Row[]): Promise<Float32Array[]> {
    const { features, width, layers, heads, patch } = this.packed.about.net;
    const [count, token, deep] = [rows.length, features * patch, layers * heads];
    const lengths = rows.map((row) => Math.ceil(row.state.length / token));
    const [tokens, words] = [Math.max(...lengths), Math.max(...rows.map((row) => row.asked.words))];
    const state = new Float32Array(count * tokens * token);
    const text = new Float32Array(count * width);
    const inner = width / heads;
    const [keys, values] = [0, 1].map(() => new Float32Array(count * deep * words * inner)) as [
      Float32Array,
      Float32Array,
    ];
    rows.forEach(({ state: own, asked }, n) => {
      state.set(own, n * tokens * token);
      text.set(asked.text, n * width);
      for (let k = 0; k < deep; k += 1) {
        const [from, size, to] = [k * asked.words * inner, asked.words * inner, (n * deep + k) * words * inner];
        keys.set(asked.keys.subarray(from, from + size), to);
        values.set(asked.values.subarray(from, from + size), to);
      }
    });
    const head = [count, layers, heads, words, inner];
    const { clean } = (await this.run("prior", {
      state: this.floats(state, [count, tokens, token]),
      level: new this.ort.Tensor(
        "int64",
        BigInt64Array.from(rows, (row) => BigInt(row.level)),
        [count],
      ),
      shown: this.floats(new Float32Array(count * tokens * width), [count, tokens, width]),
      text: this.floats(text, [count, width]),
      keys: this.floats(keys, head),
      values: this.floats(values, head),
      words: this.flags(
        each(
          rows.map((row) => row.asked.words),
          words,
        ),
        [count, words],
      ),
      valid: this.flags(each(lengths, tokens), [count, tokens]),
    })) as { clean: Numbers };
    return rows.map((row, n) => clean.data.slice(n * tokens * token, n * tokens * token + row.state.length));
  }

  /** One call after the other: ONNX Runtime Web mixes up the memory of calls that overlap, of whichever graph. */
  private run(graph: Graph, given: InferenceSession.FeedsType): Promise<InferenceSession.ReturnType> {
    const made = this.last
      .then(() => this.sessions[graph].run(given))
      .catch((error: Error) => Promise.reject(new Failed(error.message)));
    this.last = made.catch(() => undefined);
    return made;
  }

  private floats(data: Float32Array, shape: number[]): Tensor {
    return new this.ort.Tensor("float32", data, shape);
  }

  private flags(data: boolean[], shape: number[]): Tensor {
    return new this.ort.Tensor("bool", Uint8Array.from(data, Number), shape);
  }
}

/** For each row so many true flags, and false ones up to `most`. */
function each(lengths: readonly number[], most: number): boolean[] {
  return lengths.flatMap((length) => Array.from({ length: most }, (_, n) => n < length));
}
