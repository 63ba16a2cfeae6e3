import { describe, expect, it } from "vitest";
import { type Project, type Take, begins, exampleProject, length, segment } from "../src/project/model";
import {
  addSegment,
  between,
  changeSegment,
  freeze,
  freezeRest,
  layOver,
  longestTransition,
  moveSeam,
  moveSegments,
  pasteSegments,
  removeSegments,
  resizeSegment,
  setTransition,
  splitSegment,
  transitionOf,
  unfrozen,
} from "../src/project/timeline";
import { landing } from "../src/timeline/gestures";

const TAKE: Take = { motion: "m1", seed: 1, seconds: 9, people: 1, how: "drawn" };

function project(...seconds: number[]): Project {
  return {
    ...exampleProject(),
    segments: seconds.map((one, index) => ({ ...segment(`text ${index}`, one), id: `s${index}` })),
    takes: [TAKE],
  };
}

const lengths = (one: Project) => one.segments.map(({ seconds }) => seconds);
const ids = (one: Project) => one.segments.map(({ id }) => id);

describe("blocks", () => {
  it("begin where those before them end", () => {
    expect(begins(project(2, 3.5, 0.2).segments)).toEqual([0, 2, 5.5, 5.7]);
  });

  it("keep the length of the whole when a seam moves, and never get shorter than a fifth of a second", () => {
    const moved = moveSeam(project(2, 3, 4), "s0", 3.25);
    expect(lengths(moved)).toEqual([3.25, 1.75, 4]);
    expect(lengths(moveSeam(moved, "s0", 99))).toEqual([4.8, 0.2, 4]);
    expect(lengths(moveSeam(moved, "s0", -5))).toEqual([0.2, 4.8, 4]);
  });

  it("push those behind when their end moves, on whole frames", () => {
    expect(lengths(resizeSegment(project(2, 3), "s0", 2.613))).toEqual([2.6, 3]);
    expect(lengths(resizeSegment(project(2, 3), "s1", 1000))).toEqual([2, 60]);
  });

  it("are split where both halves are long enough, with the same words", () => {
    const split = splitSegment(project(2, 3), 3);
    expect(lengths(split)).toEqual([2, 1, 2]);
    expect(split.segments[2]!.text).toBe("text 1");
    expect(new Set(ids(split)).size).toBe(3);
    const whole = project(2, 3);
    expect(splitSegment(whole, 2.1)).toBe(whole);
  });

  it("are moved, pasted and removed; where none is left, an empty one is there", () => {
    expect(ids(moveSegments(project(1, 2, 3), ["s0"], 2))).toEqual(["s1", "s2", "s0"]);
    expect(ids(moveSegments(project(1, 2, 3, 4), ["s3", "s1"], 0))).toEqual(["s1", "s3", "s0", "s2"]);
    const old = project(1, 2);
    const [more, fresh] = pasteSegments(old, old.segments, 1);
    expect(lengths(more)).toEqual([1, 1, 2, 2]);
    expect(ids(more)).toEqual(["s0", ...fresh, "s1"]);
    expect(ids(removeSegments(more, fresh))).toEqual(["s0", "s1"]);
    const none = removeSegments(old, ["s0", "s1"]);
    expect(none.segments.map(({ text }) => text)).toEqual([""]);
    expect(removeSegments(none, ids(none))).toBe(none);
  });

  it("give the same project back where nothing changes, so that no step of undo is made", () => {
    const old = project(1, 2);
    expect(changeSegment(old, "s0", { text: "text 0" })).toBe(old);
    expect(moveSegments(old, ["s0"], 0)).toBe(old);
    expect(resizeSegment(old, "s0", 1)).toBe(old);
  });

  it("land where their pointer is among the others", () => {
    expect(landing(project(2, 2, 2), ["s0"], 5.5)).toBe(2);
    expect(landing(project(2, 2, 2), ["s0"], 3.5)).toBe(1);
    expect(landing(project(2, 2, 2), ["s2"], 0.5)).toBe(0);
  });

  it("lie over others, which stay when they are and are cut", () => {
    const over = layOver(project(2, 1, 4, 2), ["s1"], 5);
    expect(over.segments.map(({ text, seconds }) => [text, seconds])).toEqual([
      ["text 0", 3],
      ["text 2", 2],
      ["text 1", 1],
      ["text 2", 1],
      ["text 3", 2],
    ]);
    expect(new Set(ids(over)).size).toBe(5);
    expect(length(over)).toBe(9);
  });

  it("lie over the beginning and behind the end, and leave nothing shorter than a fifth of a second", () => {
    const first = layOver(project(2, 1), ["s1"], 0);
    expect([ids(first)[0], ...lengths(first)]).toEqual(["s1", 1, 2]);
    expect(lengths(layOver(project(2, 3), ["s0"], 4))).toEqual([4, 2]);
    expect(lengths(layOver(project(2, 1, 4), ["s1"], 3.1))).toEqual([3, 1, 3]);
    const old = project(30, 40, 30);
    expect(layOver(project(2), ["s0"], 1).segments).toHaveLength(1);
    expect(layOver(old, ["s1"], 100)).toBe(old);
  });
});

describe("transitions", () => {
  it("are a second, or half of the shorter neighbour", () => {
    expect(transitionOf(project(5, 5), 0)).toBe(1);
    expect(transitionOf(project(1, 5), 0)).toBe(0.5);
    expect(longestTransition(project(5, 3), 1)).toBe(0);
  });

  it("that are asked stay possible when blocks get shorter", () => {
    const asked = setTransition(project(5, 5), "s0", 2.4);
    expect(transitionOf(asked, 0)).toBe(2.4);
    expect(transitionOf(resizeSegment(asked, "s0", 3), 0)).toBe(1.5);
  });
});

describe("frozen stretches", () => {
  it("are joined where they touch, and what is between them is free", () => {
    const twice = freeze(freeze(project(3, 3, 3), [1, 2]), [2, 4]);
    expect(twice.frozen).toEqual([[1, 4]]);
    expect(twice.base).toBe(TAKE);
    expect(between(twice.frozen, 9)).toEqual([
      [0, 1],
      [4, 9],
    ]);
  });

  it("leave one block when the rest is frozen", () => {
    expect(freezeRest(project(3, 3, 3), "s1").frozen).toEqual([
      [0, 3],
      [6, 9],
    ]);
  });

  it("are given up when blocks are added or change their length", () => {
    const frozen = freeze(project(3, 3, 3), [0, 3]);
    expect(addSegment(frozen).base).toBeNull();
    expect(resizeSegment(frozen, "s0", 4).frozen).toEqual([]);
    expect(unfrozen(frozen).frozen).toEqual([]);
    expect(length(frozen)).toBe(9);
  });
});
