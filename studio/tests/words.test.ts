/** Numbers in words as Python reads them: `packages/motionloom/tests/tab/test_words.py` writes what to compare with. */

import { readFileSync } from "node:fs";
import { describe, expect, test } from "vitest";
import { partsOf, reading } from "../src/prior/amounts";
import { described, isSeveral } from "../src/prior/words";
import { readings, secondsInText } from "../src/tab/numbers";

const FILE = process.env.MOTIONLOOM_WORDS ?? "";

interface Row {
  text: string;
  /** Whether Python parts it into several sentences. */
  several: boolean;
  /** What is read, in words; null: nothing. */
  read: string | null;
  /** How long the words take, at most a minute. */
  seconds: number | null;
  parts: { text: string; seconds: number; transition: number; places: [number, number][]; facing: number[] }[];
}

describe.skipIf(!FILE)("numbers in words", () => {
  const rows: Row[] = FILE ? JSON.parse(readFileSync(FILE, "utf8")) : [];

  test("are read as Python reads them", () => {
    expect(rows.length).toBeGreaterThan(100);
    for (const { text, several, read, seconds } of rows) {
      const found = reading(text, 20, 60);
      if (several || isSeveral(text)) {
        expect(found, text).toEqual({ amount: null, seconds: null });
        if (!several) expect([read, seconds], text).toEqual([null, null]);
        continue;
      }
      expect(found.amount && described(found.amount), text).toBe(read);
      expect(found.seconds, text).toBe(seconds);
    }
  });

  test("become the same lengths, ways and facings", () => {
    const asked = rows.filter(({ text, parts }) => parts.length && !isSeveral(text));
    expect(asked.length).toBeGreaterThan(20);
    for (const { text, parts } of asked) {
      const { amount, seconds } = reading(text, 20, 60);
      const made = partsOf(text, seconds!, amount, 20);
      expect(
        made.map((one) => [one.text, one.seconds, one.transition]),
        text,
      ).toEqual(parts.map((one) => [one.text, one.seconds, one.transition]));
      made.forEach(({ way }, n) => {
        const { places, facing } = parts[n]!;
        expect(way?.facing?.length ?? 0, text).toBe(facing.length);
        facing.forEach((angle, f) => expect(way!.facing![f], text).toBeCloseTo(angle, 9));
        expect(!way || !!way.free, text).toBe(!places.length);
        places.forEach(([x, z], f) => {
          expect(way!.places[f]![0], text).toBeCloseTo(x, 9);
          expect(way!.places[f]![1], text).toBeCloseTo(z, 9);
        });
      });
    }
  });
});

test("the page says what it keeps of numbers, and what it leaves to the network", () => {
  const said = (text: string, path = false) => readings([{ text, seconds: 4 }], path);
  expect(said("a person walks 3 meters forward").kept).toEqual(["3 m forward, 4 s"]);
  expect(said("a person walks 3 meters forward", true).left).toEqual(['"3 m forward" gives way to the path.']);
  expect(said("jumps twice", true).kept).toEqual(["2 jumps, 4 s"]);
  expect(said("a person waves for four seconds").kept).toEqual(["4 s"]);
  expect(said("walks 100 meters").left.join()).toContain('"100 meters" is left to the network');
  expect(said("turn left 90 degrees and jump twice").left).toHaveLength(2);
  expect(said("walks 3 meters, then sits down").left.join()).toContain('"3 meters"');
  expect(said("take three steps forward and stop").kept).toEqual(["3 steps forward, 4 s"]);
  expect(said("a man of 25 walks a dog")).toEqual({ kept: [], left: [] });
  expect([secondsInText("waves for a minute"), secondsInText("waves")]).toEqual([10, null]);
});
