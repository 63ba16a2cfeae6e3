import { expect, test } from "vitest";
import { type Graphics, hasGraphics } from "../src/tab/device";

const adapter = (isFallbackAdapter: boolean): Graphics => ({
  requestAdapter: () => Promise.resolve({ info: { isFallbackAdapter } }),
});

test("the graphics processor draws where there is one that is no imitation, and the browser can wait for it", async () => {
  expect(await hasGraphics(adapter(false), true)).toBe(true);
  expect(await hasGraphics(adapter(false), false)).toBe(false);
  expect(await hasGraphics(adapter(true), true)).toBe(false);
  expect(await hasGraphics(adapter(true), true, true)).toBe(true);
});

test("without one, or where none answers, the processors draw", async () => {
  expect(await hasGraphics(undefined, true)).toBe(false);
  expect(await hasGraphics({ requestAdapter: () => Promise.resolve(null) }, true, true)).toBe(false);
  expect(await hasGraphics({ requestAdapter: () => Promise.reject(new Error("lost")) }, true)).toBe(false);
});
