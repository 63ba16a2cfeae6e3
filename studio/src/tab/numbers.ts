/** Numbers in the words, which this page does not read: the network knows little of them. */

import type { Segment } from "../prior/prior";

const COUNT = "(?:\\d+(?:\\.\\d+)?|a|an|one|two|three|four|five|six|seven|eight|nine|ten|twelve|twenty|half(?: an?)?)";
const UNITS = "m|cm|ft|feet|foot|met(?:er|re)s?|yards?|degrees?|deg|°|seconds?|secs?|minutes?|steps?|paces|strides?";
const AMOUNT = new RegExp(`(?<![\\w.])${COUNT}[ -]?(?:${UNITS})(?!\\w)`, "i");
const OFTEN = /\b(?:twice|thrice|(?:two|three|four|five|six|seven|eight|nine|ten|\d+) times)\b/i;
const TURN = /\b(?:half|quarter|full)[ -](?:turn|circle)\b/i;

/** A sentence for each number with a unit that is in the words of segments. */
export function unread(segments: readonly Segment[]): string[] {
  const found = segments.flatMap(({ text }) => [AMOUNT, OFTEN, TURN].flatMap((one) => one.exec(text)?.[0] ?? []));
  return [...new Set(found)].map(
    (number) =>
      `"${number}" is not measured here: a path says how far, the length how long; motionloom generate counts.`,
  );
}
