import { expect, test } from "vitest";
import { type Project, ofAddress, toAddress } from "../src/tab/link";

const PROJECT: Project = {
  segments: [
    { text: "walks & turns #1, 100 % = ü", seconds: 2.5 },
    { text: "jumps", seconds: 10 },
  ],
  literal: false,
  seed: 2 ** 40,
  takes: 4,
  path: [
    [0.5, -1.25],
    [2, 3],
  ],
  weights: "0123456789ab",
};

test("a project comes back from its address", () => {
  expect(ofAddress(`#${toAddress(PROJECT)}`)).toEqual(PROJECT);
  const literal = { ...PROJECT, literal: true };
  expect(ofAddress(`#${toAddress(literal)}`)).toEqual(literal);
  expect(ofAddress("")).toBeNull();
  expect(ofAddress("#")).toBeNull();
});

test("what is no project is refused", () => {
  const bad: [string, string, string][] = [
    ["seed=1099511627776", "seed=1.5", "seed is"],
    ["seed=1099511627776", "seed=1099511627777", "seed is"],
    ["n=1", "n=2", "n is"],
    ["takes=4", "takes=0", "takes is"],
    ["s=10+jumps", "s=10+", "0 letters"],
    ["s=10+jumps", `s=10+${"a".repeat(401)}`, "401 letters"],
    ["s=10+jumps", "s=1e9+jumps", "has no length"],
    ["s=10+jumps", "s=1+jumps", "shorter than 2 s"],
    ["s=10+jumps", "s=2+jumps&".repeat(12), "13 sentences"],
    ["p=0.5%2C-1.25+2%2C3", "p=1%2C2", "its path has 1 points"],
    ["p=0.5%2C-1.25+2%2C3", "p=1%2C2+3", 'a point of its path is "3"'],
    ["p=0.5%2C-1.25+2%2C3", "p=1%2C2+51%2C0", 'a point of its path is "51,0"'],
    ["p=0.5%2C-1.25+2%2C3", `p=${"1%2C2+".repeat(41)}`, "its path has 41 points"],
    ["w=0123456789ab", "w=%22", "names no weights"],
  ];
  for (const [old, next, says] of bad) {
    const address = `#${toAddress(PROJECT).replace(old, next)}`;
    expect(() => ofAddress(address), next.slice(0, 40)).toThrow(says);
  }
});
