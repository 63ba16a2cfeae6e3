import { describe, expect, it } from "vitest";
import { drawPath } from "../src/project/constraints";
import { exampleProject } from "../src/project/model";
import { curve, direction, facings, pathPoint, placeAt, simplified, timed } from "../src/project/path";

const line = [pathPoint(0, 0), pathPoint(0, 2), pathPoint(2, 2)];

describe("a path", () => {
  it("is walked evenly over the whole time", () => {
    expect(timed({ points: line, speed: null, times: null }, 8)!.times).toEqual([0, 4, 8]);
    expect(timed({ points: line, speed: null, times: null }, 8)!.speed).toBe(0.5);
  });

  it("is walked at its speed, and stays where it stops", () => {
    const stopped = [line[0]!, { ...line[1]!, stop: 1.5 }, line[2]!];
    const path = timed({ points: stopped, speed: 1, times: null }, 10)!;
    expect(path.times).toEqual([0, 2, 3.5, 5.5, 10]);
    expect(path.points[1]).toEqual(path.points[2]);
    expect(placeAt(path, 3)).toMatchObject({ x: 0, z: 2 });
    expect(placeAt(path, 99)).toMatchObject({ x: 2, z: 2 });
  });

  it("that takes too long is hurried to fit", () => {
    const path = timed({ points: line, speed: 0.1, times: null }, 4)!;
    expect(path.hurried).toBe(true);
    expect(path.times.at(-1)).toBe(4);
  });

  it("is none where all points are the same", () => {
    expect(timed({ points: [pathPoint(1, 1), pathPoint(1, 1)], speed: null, times: null }, 4)).toBeNull();
  });

  it("faces along itself where no direction is asked, and turns the short way", () => {
    const turned = [{ ...line[0]!, facing: 170 }, { ...line[1]!, facing: -170 }, line[2]!];
    expect(facings(timed({ points: line, speed: null, times: null }, 4)!)).toBeNull();
    expect(facings(timed({ points: turned, speed: null, times: null }, 4)!)!.slice(0, 2)).toEqual([170, 190]);
  });

  it("knows that +Z is 0 degrees and the left, +X, is 90", () => {
    expect(direction({ x: 0, z: 0 }, { x: 0, z: 1 })).toBeCloseTo(0);
    expect(direction({ x: 0, z: 0 }, { x: 1, z: 0 })).toBeCloseTo(90);
  });
});

describe("a line drawn by hand", () => {
  const circle = Array.from({ length: 200 }, (_, n) => ({ x: Math.cos(n / 40), z: Math.sin(n / 40) }));

  it("becomes few points, none of the line far from them", () => {
    const points = simplified(circle, 0.05);
    expect(points.length).toBeLessThan(20);
    const dense = curve(points, 40);
    for (const { x, z } of circle) {
      expect(Math.min(...dense.map((one) => Math.hypot(one.x - x, one.z - z)))).toBeLessThan(0.07);
    }
  });

  it("too short to be a path changes nothing", () => {
    const project = exampleProject();
    expect(drawPath(project, 0, [{ x: 0, z: 0 }])).toBe(project);
  });
});
