/** What the network runs on: a graphics processor where the browser offers one, else the processors. */

import graphicsGlue from "onnxruntime-web/ort-wasm-simd-threaded.jspi.mjs?url";
import graphicsWasm from "onnxruntime-web/ort-wasm-simd-threaded.jspi.wasm?url";
import glue from "onnxruntime-web/ort-wasm-simd-threaded.mjs?url";
import wasm from "onnxruntime-web/ort-wasm-simd-threaded.wasm?url";
import type { Runtime } from "../prior/network";

/** As much of `navigator.gpu` as is looked at. */
export interface Graphics {
  requestAdapter(): Promise<{ readonly info?: { readonly isFallbackAdapter?: boolean } } | null>;
}

/**
 * Whether there is a graphics processor that ONNX Runtime can compute with. Its build for WebGPU waits for answers by
 * JavaScript Promise Integration; `software`: an adapter that processors imitate will do, which tests have.
 */
export async function hasGraphics(gpu: Graphics | undefined, suspends: boolean, software = false): Promise<boolean> {
  const adapter = suspends ? await gpu?.requestAdapter().catch(() => null) : null;
  return !!adapter && (software || !adapter.info?.isFallbackAdapter);
}

/** Beyond so many threads such small products gain nothing. */
const MOST_THREADS = 4;

export const threads = (): number =>
  self.crossOriginIsolated ? Math.min(navigator.hardwareConcurrency, MOST_THREADS) : 1;

interface Build {
  readonly env: { readonly wasm: { numThreads?: number; wasmPaths?: unknown } };
}

/** ONNX Runtime for one of the two; each build is downloaded only where it is used. */
export async function runtime(graphics: boolean, base: string): Promise<Runtime> {
  const ort = await (graphics ? import("onnxruntime-web/jspi") : import("onnxruntime-web/wasm"));
  const { wasm: settings } = (ort as unknown as Build).env;
  const [mjs, binary] = graphics ? [graphicsGlue, graphicsWasm] : [glue, wasm];
  settings.numThreads = threads();
  settings.wasmPaths = { mjs: new URL(mjs, base).href, wasm: new URL(binary, base).href };
  return ort as unknown as Runtime;
}
