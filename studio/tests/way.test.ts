/** Paths on the ground; `prior.test.ts` compares what is made of them with Python. */

import { expect, test } from "vitest";
import { solveSystem } from "../src/prior/dense";
import { type Place, even, seenFrom, startOf, wayThrough } from "../src/prior/path";
import { stilled } from "../src/prior/stances";
import type { Vec } from "../src/prior/turns";

const LINE: Place[] = [
  [0, 0],
  [0, 3],
];

test("a straight line is walked at even speed, facing along it", () => {
  const { places, facing } = wayThrough(LINE, 31, 20);
  places.forEach(([x, z], f) => {
    expect(x).toBeCloseTo(0, 12);
    expect(z).toBeCloseTo(0.1 * f, 12);
  });
  expect(Math.max(...facing!.map(Math.abs))).toBeLessThan(1e-9);
});

test("a curve goes through its points, and doubles do not count", () => {
  const corner: Place[] = [
    [0, 0],
    [0, 0],
    [0, 2],
    [2, 2],
  ];
  const places = even(
    corner,
    Array.from({ length: 401 }, (_, n) => n / 400),
  );
  const nearest = Math.min(...places.map(([x, z]) => Math.hypot(x, z - 2)));
  expect(nearest).toBeLessThan(0.02);
  const steps = places.slice(1).map(([x, z], n) => Math.hypot(x - places[n]![0], z - places[n]![1]));
  expect(Math.max(...steps) / Math.min(...steps)).toBeLessThan(1.05);
});

test("who stands is asked for no direction, and what nobody runs is refused", () => {
  expect(wayThrough([LINE[0]!, LINE[0]!], 20, 20).facing).toBeNull();
  expect(() => wayThrough([LINE[0]!, [0, 40]], 40, 20)).toThrow("the path is 40.0 m long");
});

test("a way is seen from its beginning as from the origin", () => {
  const aside: Place[] = [
    [1, 2],
    [4, 2],
  ];
  const way = wayThrough(aside, 21, 20);
  const seen = seenFrom(way, startOf(way));
  expect(startOf(way).facing).toBeCloseTo(Math.PI / 2, 9);
  expect(seen.places.at(-1)![0]).toBeCloseTo(0, 9);
  expect(seen.places.at(-1)![1]).toBeCloseTo(3, 9);
});

test("a positive system is solved for several columns", () => {
  const a = Float64Array.of(4, 2, 2, 3);
  const x = solveSystem(a, Float64Array.of(8, 2, 7, 1), 2, 2);
  expect([...x].map((one) => Math.round(one * 1e9) / 1e9)).toEqual([1.25, 0.5, 1.5, 0]);
});

test("a planted foot that slides is held, and one in the air is left alone", () => {
  const ankle = Array.from({ length: 30 }, (_, f): Vec => [0.002 * f, 0.1, 0]);
  const planted = ankle.map((_, f) => [f >= 10 && f < 20, false] as const);
  const steps = stilled(ankle, ankle, planted);
  const held = ankle.map((at, f) => at[0] + steps[f]![0]).slice(10, 20);
  expect(Math.max(...held) - Math.min(...held)).toBeLessThan(1e-12);
  expect(steps[0]).toEqual([0, 0, 0]);
  expect(steps[29]![0]).toBeCloseTo(0, 12);
});
