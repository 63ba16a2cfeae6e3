import { createHash } from "node:crypto";
import { deflateSync } from "node:zlib";
import { describe, expect, test } from "vitest";
import { whole } from "../single";
import { motionClip } from "../src/body/clip";
import { packed as packedByTab } from "../src/tab/share";
import { curve } from "../src/viewer/curves";
import { placesOf } from "../src/viewer/data";

/** As `motionloom/viz/page.py` packs whole numbers (frames, 66), the root's and the others' from it. */
function packed(rows: readonly (readonly number[])[]): string {
  const changes: number[] = [];
  for (let column = 0; column < 66; column += 1)
    rows.forEach((row, frame) => changes.push(row[column]! - (rows[frame - 1]?.[column] ?? 0)));
  const bytes = new Uint8Array(Int32Array.from(changes).buffer);
  const planes = [0, 1, 2, 3].flatMap((plane) => changes.map((_, n) => bytes[n * 4 + plane]!));
  return deflateSync(Uint8Array.from(planes)).toString("base64");
}

const row = (root: number, joint: number): number[] =>
  Array.from({ length: 66 }, (_, n) => (n === 1 ? root : n === 64 ? joint : 0));

describe("places in a page", () => {
  test("are what was packed, below nought and far away too", async () => {
    const rows = [row(4000, -4000), row(4001, -3000), row(-70_000_000, 5)];
    const places = await placesOf({ frames: 3, data: packed(rows) }, 0.00025);
    expect([0, 1, 2].map((frame) => places[frame * 66 + 1])).toEqual([1, 1.00025, -17500].map(Math.fround));
    expect(places[64]).toBe(0);
    expect(places[66 + 64]).toBeCloseTo(0.25025, 5);
    expect(places[66 + 65]).toBe(0);
  });

  test("come back from what the page without a server packs", async () => {
    const places = Float32Array.from({ length: 5 * 66 }, (_, n) => Math.sin(n) * 3 + (n % 66 < 3 ? n / 10 : 0));
    const found = await placesOf({ frames: 5, data: await packedByTab(places) }, 0.00025);
    expect(Math.max(...found.map((place, n) => Math.abs(place - places[n]!)))).toBeLessThan(0.0003);
  });

  test("that are not whole are refused", async () => {
    await expect(placesOf({ frames: 4, data: packed([row(1, 1)]) }, 1)).rejects.toThrow("not whole");
  });
});

test("a curve is a joint's height, and its speed in metres a second", () => {
  const data = new Float32Array(4 * 66);
  [0, 0.1, 0.2, 0.3].forEach((height, frame) => (data[frame * 66 + 64] = height));
  const clip = motionClip(20, [data]);
  expect(curve(clip, 0, 21, "height")).toEqual([0, 0.1, 0.2, 0.3].map(Math.fround));
  for (const speed of curve(clip, 0, 21, "speed")) expect(speed).toBeCloseTo(2, 4);
});

describe("one file of a page", () => {
  const page =
    '<html><head>\n<meta charset="utf-8" />\n<style>a{}</style><script type="module" crossorigin src="./x.js"></script>' +
    '<link rel="stylesheet" crossorigin href="./x.css"></head><body></body></html>';
  const made = whole(page, "const a = '</script><!--$&';", ".b{}", "by <me@there> </script>");

  test("lets its own script run and nothing else", () => {
    const [, code] = /<script type="module">([\s\S]*?)<\/script>/.exec(made)!;
    expect(code).toBe("const a = '<\\/script><\\!--$&';");
    const hash = createHash("sha256").update(code!).digest("base64");
    expect(made).toContain(`script-src 'sha256-${hash}';`);
    expect(made).toContain("default-src 'none'");
    expect(made).not.toMatch(/unsafe|(src|href)="\.\//);
  });

  test("keeps notices as text", () => {
    expect(made).toContain("by <me@there> ‹/script></script>");
  });
});
