import { describe, expect, it } from "vitest";
import { type Action } from "../src/app/actions";
import { matchingActions } from "../src/panels/palette";
import { addMarker, changeMarker, nextStop, removeMarker } from "../src/project/markers";
import { exampleProject } from "../src/project/model";
import { GHOSTS } from "../src/stage/theme";

const action = (label: string, note = ""): Action => ({
  group: "Project",
  label,
  note,
  keys: [],
  run: () => undefined,
});
const ALL = [action("Undo"), action("Export BVH", "Motion on the 22 joints"), action("Open files"), action("Loop")];
const names = (letters: string) => matchingActions(ALL, letters).map((one) => one.label);

describe("the palette", () => {
  it("has everything without letters, and by beginnings of words first", () => {
    expect(names("")).toHaveLength(4);
    expect(names("o")[0]).toBe("Open files");
    expect(names("exp b")).toEqual(["Export BVH"]);
    expect(names("joints")).toEqual(["Export BVH"]);
    expect(names("(")).toEqual([]);
  });

  it("finds actions by the words of other programs", () => {
    const also = { ...action("Export GLB"), also: "unity fbx" };
    expect(matchingActions([...ALL, also], "unity").map((one) => one.label)).toEqual(["Export GLB"]);
  });
});

describe("markers", () => {
  it("are put at frames, sorted, moved within the motion, named and taken away", () => {
    const one = addMarker(addMarker(exampleProject(), 5.01), 2);
    expect(one.markers.map(({ time }) => time)).toEqual([2, 5]);
    expect(addMarker(one, 2)).toBe(one);
    const moved = changeMarker(one, one.markers[0]!.id, { time: 99, name: "end" });
    expect(moved.markers.map(({ time, name }) => [time, name])).toEqual([
      [5, "Marker 1"],
      [6.5, "end"],
    ]);
    expect(removeMarker(moved, moved.markers[1]!.id).markers).toHaveLength(1);
  });

  it("are stops of the playhead between the seams", () => {
    const one = addMarker(exampleProject(), 2);
    expect([nextStop(one, 0, 1), nextStop(one, 2, 1), nextStop(one, 6, 1)]).toEqual([2, 3.5, 6.5]);
    expect([nextStop(one, 3.5, -1), nextStop(one, 1, -1)]).toEqual([2, 0]);
  });
});

describe("colours of takes", () => {
  const lab = (hex: string): number[] => {
    const [r, g, b] = [1, 3, 5].map((at) => {
      const value = parseInt(hex.slice(at, at + 2), 16) / 255;
      return value <= 0.04045 ? value / 12.92 : ((value + 0.055) / 1.055) ** 2.4;
    }) as [number, number, number];
    const f = (value: number) => (value > 0.008856 ? Math.cbrt(value) : 7.787 * value + 16 / 116);
    const [x, y, z] = [
      f((0.4124 * r + 0.3576 * g + 0.1805 * b) / 0.9505),
      f(0.2126 * r + 0.7152 * g + 0.0722 * b),
      f((0.0193 * r + 0.1192 * g + 0.9505 * b) / 1.089),
    ];
    return [116 * y - 16, 500 * (x - y), 200 * (y - z)];
  };
  const apart = (a: string, b: string) => Math.hypot(...lab(a).map((one, axis) => one - lab(b)[axis]!));

  it("differ from each other, and from the accent of both themes", () => {
    const all = [...GHOSTS, "#a84e1a", "#f08a4b"];
    GHOSTS.forEach((one, index) =>
      all.forEach((other, number) => {
        if (number !== index) expect(apart(one, other), `${one} and ${other}`).toBeGreaterThan(22);
      }),
    );
  });
});
