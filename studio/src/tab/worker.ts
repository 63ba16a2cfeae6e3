/** The prior in a thread of its own, so that the page never stalls. */

import * as ort from "onnxruntime-web/wasm";
import glue from "onnxruntime-web/ort-wasm-simd-threaded.mjs?url";
import wasm from "onnxruntime-web/ort-wasm-simd-threaded.wasm?url";
import { Network, type Runtime } from "../prior/network";
import { placesOf } from "../prior/person";
import { startOf } from "../prior/path";
import { Prior, finished, flat, sketched } from "../prior/prior";
import { type Manifest, Packed } from "../prior/weights";
import type { Draw, Said, Stop } from "./messages";

/** Beyond so many threads such small products gain nothing. */
const MOST_THREADS = 4;
const CACHE = "motionloom-weights";

const say = (said: Said): void => postMessage(said);
let newest = -1;
class Superseded extends Error {}

/** The weights, from the browser's own store where they were kept there. */
async function download(base: string): Promise<Packed> {
  const about = (await (await fetched(new URL("prior.json", base))).json()) as Manifest;
  const place = new URL(`prior.bin?${about.sha256}`, base);
  const store = "caches" in self ? await caches.open(CACHE) : null;
  const kept = await store?.match(place);
  const data = await received(kept ?? (await fetched(place)), about.bytes);
  if (!kept && (await digest(data)) === about.sha256) {
    for (const old of (await store?.keys()) ?? []) await store!.delete(old);
    await store?.put(place, new Response(data)).catch(() => undefined); // a full disk keeps nobody from drawing
  }
  return new Packed(about, data);
}

async function fetched(place: URL): Promise<Response> {
  const answer = await fetch(place).catch(() => null);
  if (!answer?.ok) throw new Error(`the weights cannot be loaded (${place.pathname}); load the page again when online`);
  return answer;
}

async function received(answer: Response, of: number): Promise<ArrayBuffer> {
  const all = new Uint8Array(of);
  let done = 0;
  for (const reader = answer.body!.getReader(); ;) {
    const part = await reader.read();
    if (part.done) break;
    if (done + part.value.length > of) throw new Error("the weights are longer than they say; load the page again");
    all.set(part.value, done);
    done += part.value.length;
    say({ kind: "loading", done, of });
  }
  if (done < of) throw new Error(`of the weights ${done} of ${of} bytes came; load the page again`);
  return all.buffer;
}

/** Empty where the page was not served safely enough for the browser to compute one: nothing is kept then. */
async function digest(data: ArrayBuffer): Promise<string> {
  if (!crypto.subtle) return "";
  const bytes = new Uint8Array(await crypto.subtle.digest("SHA-256", data));
  return Array.from(bytes, (byte) => byte.toString(16).padStart(2, "0")).join("");
}

async function open(base: string): Promise<Prior> {
  const { wasm: settings } = ort.env;
  settings.numThreads = self.crossOriginIsolated ? Math.min(navigator.hardwareConcurrency, MOST_THREADS) : 1;
  settings.wasmPaths = { mjs: new URL(glue, base).href, wasm: new URL(wasm, base).href };
  const packed = await download(base);
  const network = await Network.open(ort as unknown as Runtime, packed).catch((error: Error) => {
    throw new Error(`this browser cannot run the network (${error.message.slice(0, 200)}); use a newer one`);
  });
  const prior = new Prior(network);
  const { weights, name, licence, data } = prior.network.packed.about;
  say({ kind: "ready", about: { weights, name, licence, data }, threads: settings.numThreads });
  return prior;
}

async function draw(prior: Prior, { id, segments, seed, takes, path }: Draw): Promise<void> {
  const way = path.length > 1 ? prior.way(segments, path) : null;
  const begin = way ? startOf(way) : undefined;
  const watch = async (done: number, of: number, clean: () => Float32Array[]): Promise<void> => {
    say({
      kind: "sketch",
      id,
      done,
      of,
      takes: done * 3 >= of ? clean().map((features) => sketched(features, begin)) : [],
    });
    await new Promise((heard) => setTimeout(heard)); // lets a newer wish be heard
    if (newest !== id) throw new Superseded();
  };
  const made = await prior.features(segments, seed, takes, watch, way);
  const bodies = made.map((features) => finished(features, prior.fps, begin));
  say({ kind: "drawn", id, bodies, takes: bodies.map((body) => flat(placesOf(body))) });
}

let prior: Promise<Prior> | null = null;
let last: Promise<void> = Promise.resolve();

onmessage = ({ data }: MessageEvent<string | Draw | Stop>) => {
  if (typeof data === "string") {
    prior = open(data);
    prior.catch((error: Error) => say({ kind: "failed", id: null, message: error.message }));
    return;
  }
  if ("stop" in data) {
    newest = data.stop;
    return;
  }
  newest = data.id;
  last = last.then(async () => {
    try {
      if (newest === data.id) await draw(await prior!, data);
    } catch (error) {
      if (!(error instanceof Superseded)) say({ kind: "failed", id: data.id, message: (error as Error).message });
    }
  });
};
