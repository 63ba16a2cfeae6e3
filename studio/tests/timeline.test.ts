import { describe, expect, it } from "vitest";
import { type Project, type Take, begins, exampleProject, length, segment } from "../src/project/model";
import {
  addSegment,
  between,
  changeSegment,
  duplicateSegment,
  freeze,
  freezeRest,
  longestTransition,
  moveSeam,
  moveSegment,
  removeSegment,
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

  it("are moved, doubled and removed, but the last one stays", () => {
    expect(ids(moveSegment(project(1, 2, 3), "s0", 2))).toEqual(["s1", "s2", "s0"]);
    expect(lengths(duplicateSegment(project(1, 2), "s0"))).toEqual([1, 1, 2]);
    const one = removeSegment(project(1, 2), "s0");
    expect(ids(one)).toEqual(["s1"]);
    expect(removeSegment(one, "s1")).toBe(one);
  });

  it("give the same project back where nothing changes, so that no step of undo is made", () => {
    const old = project(1, 2);
    expect(changeSegment(old, "s0", { text: "text 0" })).toBe(old);
    expect(moveSegment(old, "s0", 0)).toBe(old);
    expect(resizeSegment(old, "s0", 1)).toBe(old);
  });

  it("land where their pointer is among the others", () => {
    expect(landing(project(2, 2, 2), "s0", 5.5)).toBe(2);
    expect(landing(project(2, 2, 2), "s0", 3.5)).toBe(1);
    expect(landing(project(2, 2, 2), "s2", 0.5)).toBe(0);
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
