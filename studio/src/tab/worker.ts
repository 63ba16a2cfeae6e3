/** The prior in a thread of its own, so that the page never stalls. */

import { Failed, Network } from "../prior/network";
import { Prior, flat, sketched } from "../prior/prior";
import { type Viewer, spoken } from "../prior/spoken";
import { type Manifest, Packed } from "../prior/weights";
import { type Graphics, hasGraphics, runtime, threads } from "./device";
import { LONGEST } from "./link";
import type { Draw, WorkerMessage, Stop } from "./messages";

const CACHE = "motionloom-weights";

const say = (said: WorkerMessage): void => postMessage(said);
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

/** The prior of weights that are there; the network's own graph runs on the graphics processor where `graphics` says so. */
async function open(packed: Packed, base: string, graphics: boolean, remark = ""): Promise<Prior> {
  const network = await Network.open(await runtime(graphics, base), packed, graphics);
  const { weights, name, licence, data } = packed.about;
  say({ kind: "ready", about: { weights, name, licence, data }, threads: threads(), graphics, remark });
  return new Prior(network);
}

/** Without the graphics processor, which failed if `why` says so. */
async function onProcessors(packed: Packed, base: string, why?: Error): Promise<Prior> {
  const remark = why && `The graphics processor fails (${why.message.slice(0, 120)}); the processors draw instead.`;
  return open(packed, base, false, remark).catch((error: Error) => {
    throw new Error(`this browser cannot run the network (${error.message.slice(0, 200)}); use a newer one`);
  });
}

async function begin(base: string): Promise<Prior> {
  const software = new URL(base).searchParams.get("webgpu") === "software";
  const { gpu } = navigator as { gpu?: Graphics };
  const [packed, graphics] = await Promise.all([
    download(base),
    hasGraphics(gpu, "Suspending" in WebAssembly, software),
  ]);
  if (!graphics) return onProcessors(packed, base);
  return open(packed, base, true).catch((error: Error) => onProcessors(packed, base, error));
}

async function draw(prior: Prior, { id, takes, path, ...wish }: Draw): Promise<void> {
  const made = await spoken(prior, { ...wish, takes, path, longest: LONGEST }, watching(id));
  if (!made.every(({ features }) => features.every(Number.isFinite))) throw new Failed("its numbers are none");
  const [bodies, misses] = [made.map((one) => one.body), made.map((one) => one.misses)];
  say({ kind: "drawn", id, bodies, takes: made.map((one) => flat(one.places)), misses });
}

/** What the page hears while a motion is drawn; ends the drawing where it is no longer wanted. */
function watching(id: number): Viewer {
  return async (done, of, clean, begin) => {
    const takes = done * 3 >= of ? clean().map((features) => sketched(features, begin)) : [];
    say({ kind: "sketch", id, done, of, takes });
    await new Promise((heard) => setTimeout(heard)); // lets a newer wish be heard
    if (newest !== id) throw new Superseded();
  };
}

/** Draw; where the graphics processor fails at it, without it, and so from then on. */
async function generate(data: Draw): Promise<void> {
  const now = await prior!;
  try {
    await draw(now, data);
  } catch (error) {
    if (!(error instanceof Failed) || !now.network.graphics) throw error;
    prior = onProcessors(now.network.packed, place, error);
    await draw(await prior, data);
  }
}

let prior: Promise<Prior> | null = null;
let place = "";
let last: Promise<void> = Promise.resolve();

onmessage = ({ data }: MessageEvent<string | Draw | Stop>) => {
  if (typeof data === "string") {
    place = data;
    prior = begin(data);
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
      if (newest === data.id) await generate(data);
    } catch (error) {
      if (!(error instanceof Superseded)) say({ kind: "failed", id: data.id, message: (error as Error).message });
    }
  });
};
