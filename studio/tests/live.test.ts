import { describe, expect, it } from "vitest";
import { Recording } from "../src/app/recording";
import { placesOf } from "../src/body/forward";
import { floats } from "../src/server/api";
import type { LiveFrame } from "../src/server/live";

const frame = (number: number, words: string): LiveFrame => ({
  type: "frame",
  frame: number,
  time: number / 20,
  root: [number / 20, 1, 0],
  rotations: Array.from({ length: 22 }, () => [1, 0, 0, 0] as const),
  words,
});

describe("forward kinematics", () => {
  it("carries a limb with its parent's rotation", () => {
    const quarter = Math.SQRT1_2;
    const bones = {
      parents: [-1, 0, 1],
      offsets: [
        [9, 9, 9],
        [0, 1, 0],
        [0, 1, 0],
      ] as const,
    };
    const places = placesOf(
      bones,
      [2, 0, 0],
      [
        [quarter, 0, 0, quarter],
        [1, 0, 0, 0],
        [1, 0, 0, 0],
      ],
    );
    [2, 0, 0, 1, 0, 0, 0, 0, 0].forEach((one, n) => expect(places[n]).toBeCloseTo(one, 5));
  });
});

describe("a recording", () => {
  const recording = new Recording(20);
  const words = [...Array(40).fill("walk"), ...Array(4).fill("jump"), ...Array(30).fill("run")] as string[];
  words.forEach((one, number) => recording.add(frame(number, one)));

  it("has a block for each stretch of the same words; what was said in passing belongs to the one before", () => {
    expect(recording.segments().map(({ text, seconds }) => [text, seconds])).toEqual([
      ["walk", 2.2],
      ["run", 1.5],
    ]);
    expect(recording.next).toBe(74);
  });

  it("is written as the server reads it", async () => {
    const { fps, people } = JSON.parse(await recording.file().text()) as {
      fps: number;
      people: [{ root: string; rotations: string }];
    };
    expect(fps).toBe(20);
    const root = floats(people[0].root);
    expect(root.length).toBe(74 * 3);
    expect(root[73 * 3]).toBeCloseTo(73 / 20, 5);
    expect(floats(people[0].rotations).length).toBe(74 * 22 * 4);
  });
});
