/** The project in the page's address, behind the #, so that whoever opens it sees the same motion. */

import type { Place } from "../prior/path";
import type { Segment } from "../prior/prior";

export interface Project {
  readonly segments: readonly Segment[];
  /** Whether numbers in the words are left to the network, as in links that do not say `n=1`. */
  readonly literal: boolean;
  readonly seed: number;
  readonly takes: number;
  /** Points on the floor, x and z in metres, that are walked at even speed; none: nobody asks where. */
  readonly path: readonly Place[];
  /** Beginning of the digest of the weights it was drawn with; empty: never drawn. */
  readonly weights: string;
}

export const FIRST: Project = {
  segments: [{ text: "a person walks forward and waves", seconds: 4 }],
  literal: false,
  seed: 1,
  takes: 1,
  path: [],
  weights: "",
};

export const [SHORTEST, LONGEST, MOST, LETTERS, LARGEST] = [0.5, 10, 12, 400, 2 ** 40] as const;
/** Points of a path, and metres from the middle of the floor. */
export const [MOST_POINTS, FARTHEST] = [40, 50] as const;
/** A segment between two others shares a second with them. */
export const SHORTEST_OF_SEVERAL = 2;
const DIGEST = 12;

/** Without the #. */
export function toAddress({ segments, literal, seed, takes, path, weights }: Project): string {
  const found = new URLSearchParams({ v: "1", seed: String(seed), takes: String(takes) });
  for (const { text, seconds } of segments) found.append("s", `${seconds} ${text}`);
  if (!literal) found.set("n", "1");
  if (path.length) found.set("p", path.map((at) => at.join(",")).join(" "));
  if (weights) found.set("w", weights.slice(0, DIGEST));
  return found.toString();
}

/** Null where nothing is behind the #; an Error says in a sentence why a link cannot be opened. */
export function ofAddress(hash: string): Project | null {
  if (hash.length < 2) return null;
  const parameters = new URLSearchParams(hash.slice(1));
  const refuse = (what: string): never => {
    throw new Error(`This link cannot be opened: ${what}; ask for it again, or write your own words.`);
  };
  if (parameters.get("v") !== "1")
    refuse(`its version is ${JSON.stringify((parameters.get("v") ?? "none").slice(0, 20))}, not 1`);
  const whole = (name: string, low: number, high: number): number => {
    const text = parameters.get(name) ?? "";
    if (!/^\d{1,13}$/.test(text) || Number(text) < low || Number(text) > high)
      refuse(`${name} is ${JSON.stringify(text.slice(0, 20))}, not a whole number from ${low} to ${high}`);
    return Number(text);
  };
  const segments = parameters.getAll("s").map((one) => {
    const [, number, text] = /^(\d{1,2}(?:\.\d{1,2})?) ([^]*)$/.exec(one) ?? refuse("a sentence in it has no length");
    const seconds = Number(number);
    if (seconds < SHORTEST || seconds > LONGEST) refuse(`a length is ${seconds} s, not ${SHORTEST} to ${LONGEST} s`);
    if (!text!.trim() || text!.length > LETTERS)
      refuse(`a sentence has ${text!.trim().length} letters, not 1 to ${LETTERS}`);
    return { text: text!, seconds };
  });
  if (segments.length < 1 || segments.length > MOST) refuse(`it has ${segments.length} sentences, not 1 to ${MOST}`);
  if (segments.length > 1 && segments.some((one) => one.seconds < SHORTEST_OF_SEVERAL))
    refuse(`one of several sentences is shorter than ${SHORTEST_OF_SEVERAL} s`);
  const weights = parameters.get("w") ?? "";
  if (!/^[0-9a-f]{0,64}$/.test(weights)) refuse("it names no weights");
  const path = (parameters.get("p") ?? "")
    .split(" ")
    .filter(Boolean)
    .map((point): Place => {
      const [, x, z] = /^(-?\d{1,2}(?:\.\d{1,3})?),(-?\d{1,2}(?:\.\d{1,3})?)$/.exec(point) ?? [];
      if (x === undefined || Math.max(Math.abs(Number(x)), Math.abs(Number(z))) > FARTHEST)
        refuse(
          `a point of its path is ${JSON.stringify(point.slice(0, 20))}, not two numbers of at most ${FARTHEST} m`,
        );
      return [Number(x), Number(z)];
    });
  if (path.length === 1 || path.length > MOST_POINTS)
    refuse(`its path has ${path.length} points, not 2 to ${MOST_POINTS}`);
  const literal = !parameters.has("n") || whole("n", 0, 1) === 0;
  return { segments, literal, seed: whole("seed", 0, LARGEST), takes: whole("takes", 1, 4), path, weights };
}
