/** Words to motion, in a browser or in Node: `const motion = await (await Prior.load(folder)).generate("walks")`. */

import { JOINTS as NAMES, PARENTS as ABOVE } from "../../../src/body/skeleton";
import { Network, type Runtime as Built } from "../../../src/prior/network";
import { REST as OFFSETS } from "../../../src/prior/person";
import { Prior as Sampler, flat, sketched } from "../../../src/prior/prior";
import { type Take, type Viewer, spoken } from "../../../src/prior/spoken";
import { reading } from "../../../src/prior/amounts";
import { type Manifest, Packed } from "../../../src/prior/weights";
import { bvh } from "../../../src/tab/bvh";
import { LARGEST, LETTERS, LONGEST, MOST, SHORTEST, SHORTEST_OF_SEVERAL } from "../../../src/tab/link";

/** Names of the 22 joints, in the order of all arrays. */
export const JOINTS: readonly string[] = NAMES;
/** For each joint the number of the joint it hangs on; -1: none. */
export const PARENTS: readonly number[] = ABOVE;
/** Place of each joint in the frame of its parent, metres; a T-pose that faces +Z, the left hand at +X. */
export const REST: readonly (readonly [number, number, number])[] = OFFSETS;

/** ONNX Runtime: the module `onnxruntime-web`, one of its parts, or `onnxruntime-node`. */
export interface Runtime {
  readonly InferenceSession: object;
  readonly Tensor: object;
}

export interface LoadOptions {
  /** Without one `onnxruntime-web/wasm` is imported. */
  readonly runtime?: Runtime;
  /** Of WebAssembly; 1 in Node and in pages that are not cross-origin isolated, else up to 4. */
  readonly threads?: number;
  /** Where a page finds the .wasm of ONNX Runtime, where the bundler has moved it. */
  readonly wasm?: string;
  /** Called while the weights arrive. */
  readonly progress?: (bytes: number, of: number) => void;
}

export interface Sentence {
  readonly text: string;
  /** 0.5 to 10; one of several sentences: 2 to 10. */
  readonly seconds: number;
}

export interface GenerateOptions {
  /** Length where the words are one text: 0.5 to 10 (default: as long as numbers in the words take, else 5). */
  readonly seconds?: number;
  /** Numbers in the words ("turn left 90 degrees", "jump three times") are left to the network (default: they are kept). */
  readonly literal?: boolean;
  /** A whole number from 0 to 2^40 (default: 0): the same one gives the same motion, in Python too. */
  readonly seed?: number;
  /** Points on the ground (x, z), metres, which the pelvis follows at an even pace; 2 or more. */
  readonly path?: readonly (readonly [number, number])[];
  /** Called behind each of the network's calls; `preview` gives places of joints as they are guessed so far. */
  readonly progress?: (call: number, of: number, preview: () => Float32Array) => void;
  readonly signal?: AbortSignal;
}

/** One person moving. +Y is up, metres; without a path the person begins at the origin and faces +Z. */
export interface Motion {
  readonly fps: number;
  readonly frames: number;
  readonly seconds: number;
  /** Places of joints in the world: frames x 22 x 3. */
  readonly positions: Float32Array;
  /** Turns of joints in their parent's frame: frames x 22 x 4, quaternions w, x, y, z. */
  readonly rotations: Float32Array;
  /** Place of the pelvis: frames x 3. */
  readonly root: Float32Array;
  /** What the network made, before bones had a length and feet stood still: frames x 263 (docs/features.md). */
  readonly features: Float32Array;
  /** A sentence for each number in the words that the motion does not keep. */
  readonly missed: readonly string[];
  /** The motion as a BVH file, in metres. */
  bvh(): string;
}

/** What a folder of weights says of itself. */
export interface About {
  readonly name: string;
  /** SHA-256 of the weight file. */
  readonly weights: string;
  readonly licence: string;
  /** What they were trained on, whom to name. */
  readonly data: string;
  readonly fps: number;
}

export class Prior {
  private readonly sampler: Sampler;

  private constructor(sampler: Sampler) {
    this.sampler = sampler;
  }

  /**
   * Read `prior.json` and `prior.bin` from a folder, which `tools/export_tab.py` writes.
   *
   * folder: an address, absolute or against the page's; in Node also a path. Raises an Error that says which file is
   * missing or broken.
   */
  static async load(folder: string | URL, options: LoadOptions = {}): Promise<Prior> {
    const said = new TextDecoder().decode(await read(folder, "prior.json"));
    let about: Manifest;
    try {
      about = JSON.parse(said) as Manifest;
    } catch {
      throw new Error(`prior.json in ${folder} is not JSON; write the folder again (tools/export_tab.py)`);
    }
    const data = await read(
      folder,
      "prior.bin",
      options.progress && ((bytes) => options.progress!(bytes, about.bytes)),
    );
    return Prior.open(about, data, options);
  }

  /** From what `prior.json` says and the bytes of `prior.bin`, wherever they come from. */
  static async open(about: object, data: ArrayBuffer, options: LoadOptions = {}): Promise<Prior> {
    const packed = new Packed(about as Manifest, data);
    const runtime = options.runtime ?? (await wasm(options));
    return new Prior(new Sampler(await Network.open(runtime as Built, packed)));
  }

  get about(): About {
    const { name, weights, licence, data, fps } = this.sampler.network.packed.about;
    return { name, weights, licence, data, fps };
  }

  /** A motion of a text, or of several sentences one after the other, which share a second where they meet. */
  async generate(words: string | readonly Sentence[], options: GenerateOptions = {}): Promise<Motion> {
    const { seed = 0, path = [], literal = false, progress, signal } = options;
    const { fps } = this.sampler;
    const said = typeof words === "string" && !literal ? reading(words, fps, LONGEST).seconds : null;
    const segments = typeof words === "string" ? [{ text: words, seconds: options.seconds ?? said ?? 5 }] : words;
    check(segments, seed, options.path);
    const watch: Viewer = async (call, of, takes, begin) => {
      signal?.throwIfAborted();
      progress?.(call, of, () => sketched(takes()[0]!, begin));
    };
    const [take] = await spoken(this.sampler, { segments, literal, seed, takes: 1, path, longest: LONGEST }, watch);
    return motionOf(take!);
  }
}

function check(sentences: readonly Sentence[], seed: number, path: GenerateOptions["path"]): void {
  const shortest = sentences.length > 1 ? SHORTEST_OF_SEVERAL : SHORTEST;
  if (sentences.length < 1 || sentences.length > MOST)
    throw new RangeError(`a motion has 1 to ${MOST} sentences; got ${sentences.length}`);
  for (const { text, seconds } of sentences) {
    if (!(seconds >= shortest && seconds <= LONGEST))
      throw new RangeError(`a sentence lasts ${shortest} to ${LONGEST} seconds; got ${seconds}`);
    if (text.length > LETTERS) throw new RangeError(`a sentence has at most ${LETTERS} letters; got ${text.length}`);
  }
  if (!Number.isInteger(seed) || seed < 0 || seed > LARGEST)
    throw new RangeError(`a seed is a whole number from 0 to ${LARGEST}; got ${seed}`);
  if (path && (path.length < 2 || !path.flat().every(Number.isFinite)))
    throw new RangeError("a path has two points or more, each two numbers of metres");
}

function motionOf({ body, features, places, misses }: Take): Motion {
  const { fps, root, turns } = body;
  return {
    fps,
    frames: root.length,
    seconds: root.length / fps,
    positions: flat(places),
    rotations: Float32Array.from(turns.flat(2)),
    root: Float32Array.from(root.flat()),
    features,
    missed: misses,
    bvh: () => bvh(body),
  };
}

interface Files {
  readFile(place: string | URL): Promise<Uint8Array>;
}

/** Node's files; null in a browser. Bundlers for browsers see no import that they would have to follow. */
const node = globalThis.process?.versions?.node
  ? ((globalThis.process.getBuiltinModule("node:fs") as { promises: Files } | undefined)?.promises ?? null)
  : null;

async function read(folder: string | URL, name: string, progress?: (bytes: number) => void): Promise<ArrayBuffer> {
  const base = String(folder).replace(/\/*$/, "/");
  const isAddress = /^(https?|blob|data):/.test(base);
  const failed = (why: string): Error =>
    new Error(`${name} cannot be read from ${folder} (${why}); tools/export_tab.py writes it`);
  if (node && !isAddress) {
    const place = base.startsWith("file:") ? new URL(name, base) : base + name;
    const found = await node.readFile(place).catch((error: Error) => Promise.reject(failed(error.message)));
    progress?.(found.length);
    return new Uint8Array(found).buffer;
  }
  const place = new URL(name, isAddress ? base : new URL(base, document.baseURI));
  const answer = await fetch(place).catch((error: Error) => Promise.reject(failed(error.message)));
  if (!answer.ok) throw failed(`the answer is ${answer.status}`);
  if (!progress || !answer.body) return answer.arrayBuffer();
  const parts: Uint8Array<ArrayBuffer>[] = [];
  let bytes = 0;
  for (const reader = answer.body.getReader(); ;) {
    const { done, value } = await reader.read();
    if (done) return new Blob(parts).arrayBuffer();
    parts.push(value);
    progress((bytes += value.length));
  }
}

async function wasm({ threads, wasm: place }: LoadOptions): Promise<Runtime> {
  const runtime = await import("onnxruntime-web/wasm");
  const settings = runtime.env.wasm;
  settings.numThreads = threads ?? (globalThis.crossOriginIsolated ? Math.min(navigator.hardwareConcurrency, 4) : 1);
  if (place !== undefined) settings.wasmPaths = place;
  return runtime as unknown as Runtime;
}
