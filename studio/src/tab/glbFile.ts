/** Binary glTF files: taken apart, and put together with what is new in them. */

import type { Turn, Vec } from "../prior/turns";

/** What is read of a file's JSON; all else in it stays as it is. */
export interface Content {
  asset: { version: string };
  nodes?: {
    name?: string;
    children?: number[];
    translation?: number[];
    rotation?: number[];
    scale?: number[];
    matrix?: number[];
    skin?: number;
    mesh?: number;
  }[];
  meshes?: unknown[];
  skins?: { joints: number[]; inverseBindMatrices?: number }[];
  accessors?: Record<string, unknown>[];
  bufferViews?: {
    buffer: number;
    byteOffset?: number;
    byteLength: number;
    byteStride?: number;
    extensions?: unknown;
  }[];
  buffers?: { byteLength: number; uri?: string }[];
  animations?: unknown[];
  extensions?: Record<string, unknown>;
  extensionsUsed?: string[];
  extensionsRequired?: string[];
  scenes?: { nodes?: number[] }[];
  scene?: number;
}

const [MAGIC, JSON_CHUNK, BINARY_CHUNK] = [0x46546c67, 0x4e4f534a, 0x004e4942];

/** Its JSON and the binary part; an Error says in a sentence what is wrong. */
export function unpacked(data: ArrayBuffer): { content: Content; binary: Uint8Array } {
  const view = new DataView(data);
  if (data.byteLength < 20 || view.getUint32(0, true) !== MAGIC)
    throw new Error("it is no binary glTF; drop a GLB or VRM file");
  if (view.getUint32(4, true) !== 2) throw new Error("it is not glTF 2.0; export it again as a newer GLB");
  let content: Content | null = null;
  let binary = new Uint8Array();
  for (let at = 12; at + 8 <= data.byteLength;) {
    const [length, kind] = [view.getUint32(at, true), view.getUint32(at + 4, true)];
    if (at + 8 + length > data.byteLength) throw new Error("its end is missing; copy the file again");
    const bytes = new Uint8Array(data, at + 8, length);
    if (kind === JSON_CHUNK && !content) content = parsed(bytes);
    else if (kind === BINARY_CHUNK && !binary.length) binary = bytes;
    at += 8 + length + (-length & 3);
  }
  if (!content) throw new Error("it holds no scene; export it again");
  return { content, binary };
}

function parsed(bytes: Uint8Array): Content {
  try {
    return JSON.parse(new TextDecoder().decode(bytes)) as Content;
  } catch {
    throw new Error("its text is damaged; export it again");
  }
}

/** A file in the making: a copy of the content, with numbers put behind the binary part. */
export class Packing {
  readonly content: Content;
  private readonly parts: Uint8Array[] = [];
  private length: number;

  constructor(content: Content, binary: Uint8Array) {
    this.content = structuredClone(content);
    this.parts.push(binary, new Uint8Array(-binary.length & 3));
    this.length = binary.length + (-binary.length & 3);
  }

  /** Put numbers of so many to an item; gives their accessor. */
  add(numbers: Float32Array, type: "SCALAR" | "VEC3" | "VEC4"): number {
    const { content } = this;
    const width = { SCALAR: 1, VEC3: 3, VEC4: 4 }[type];
    const bounds = (pick: (...all: number[]) => number): number[] =>
      Array.from({ length: width }, (_, k) => numbers.filter((__, n) => n % width === k).reduce((a, b) => pick(a, b)));
    (content.bufferViews ??= []).push({ buffer: 0, byteOffset: this.length, byteLength: numbers.byteLength });
    (content.accessors ??= []).push({
      bufferView: content.bufferViews.length - 1,
      componentType: 5126,
      count: numbers.length / width,
      type,
      min: bounds(Math.min),
      max: bounds(Math.max),
    });
    this.parts.push(new Uint8Array(numbers.buffer, numbers.byteOffset, numbers.byteLength));
    this.length += numbers.byteLength;
    return content.accessors.length - 1;
  }

  /** Put an animation of nodes, which becomes the only one; its numbers become multiples of `grain`, if that is not 0. */
  animate(name: string, moves: Moves, grain = 0): void {
    const rounded = (all: readonly number[]): Float32Array =>
      Float32Array.from(all, (x) => (grain ? Math.round(x / grain) * grain : x));
    const frames = Math.max(...[...moves.turns.values(), ...moves.places.values()].map((values) => values.length));
    const times = this.add(
      Float32Array.from({ length: frames }, (_, f) => f / moves.fps),
      "SCALAR",
    );
    const [channels, samplers]: [unknown[], unknown[]] = [[], []];
    const put = (node: number, path: string, output: number): void => {
      channels.push({ sampler: samplers.length, target: { node, path } });
      samplers.push({ input: times, output, interpolation: "LINEAR" });
    };
    for (const [node, turns] of moves.turns)
      put(node, "rotation", this.add(rounded(turns.flatMap(([w, x, y, z]) => [x, y, z, w])), "VEC4"));
    for (const [node, places] of moves.places) put(node, "translation", this.add(rounded(places.flat()), "VEC3"));
    this.content.animations = [{ name, channels, samplers }];
  }

  bytes(): ArrayBuffer {
    const { content } = this;
    content.buffers = [{ byteLength: this.length }, ...(content.buffers ?? []).slice(1)];
    const text = new TextEncoder().encode(JSON.stringify(content));
    const padded = text.length + (-text.length & 3);
    const result = new Uint8Array(28 + padded + this.length).fill(32, 20 + text.length, 20 + padded);
    const view = new DataView(result.buffer);
    [MAGIC, 2, result.length, padded, JSON_CHUNK].forEach((word, n) => view.setUint32(4 * n, word, true));
    result.set(text, 20);
    view.setUint32(20 + padded, this.length, true);
    view.setUint32(24 + padded, BINARY_CHUNK, true);
    this.parts.reduce((at, part) => {
      result.set(part, at);
      return at + part.length;
    }, 28 + padded);
    return result.buffer;
  }
}

/** The binary part with zeros, which take no room deflated, where only animations have their numbers. */
export function withoutAnimations(content: Content, binary: Uint8Array): Uint8Array {
  const { animations, accessors = [], bufferViews = [], meshes, skins, nodes, ...rest } = content;
  if (bufferViews.some((view) => view.extensions || view.buffer)) return binary;
  const matrices = ["inverseBindMatrices", "extensions"];
  const used = [...numbersIn(meshes), ...numbersIn(skins, matrices), ...numbersIn(nodes, matrices)];
  const lost = new Set(numbersIn(animations, ["samplers"]));
  for (const number of used) lost.delete(number);
  const kept = new Set([
    ...numbersIn(
      accessors.filter((_, n) => !lost.has(n)),
      ["bufferView"],
    ),
    ...numbersIn([meshes, skins, nodes, rest], ["bufferView"]),
  ]);
  const result = new Uint8Array(binary.length);
  bufferViews.forEach(({ byteOffset = 0, byteLength }, n) => {
    if (kept.has(n)) result.set(binary.subarray(byteOffset, byteOffset + byteLength), byteOffset);
  });
  return result;
}

/** Numbers anywhere in JSON; `keys`: those below such a key alone. */
function numbersIn(found: unknown, keys: readonly string[] | null = null): number[] {
  if (typeof found === "number") return keys ? [] : [found];
  if (Array.isArray(found)) return found.flatMap((one) => numbersIn(one, keys));
  if (!found || typeof found !== "object") return [];
  return Object.entries(found).flatMap(([key, one]) => numbersIn(one, keys?.includes(key) ? null : keys));
}

/** How nodes of a file move: by their numbers, turns and places in their parents. */
export interface Moves {
  readonly fps: number;
  readonly turns: ReadonlyMap<number, readonly Turn[]>;
  readonly places: ReadonlyMap<number, readonly Vec[]>;
}
