/** Numbers in the words, as the page tells what it reads of them. */

import type { Segment } from "../prior/prior";
import { reading } from "../prior/amounts";
import { described } from "../prior/words";
import { LONGEST } from "./link";

const FPS = 20;
const COUNT = "(?:\\d+(?:\\.\\d+)?|a|an|one|two|three|four|five|six|seven|eight|nine|ten|twelve|twenty|half(?: an?)?)";
const UNITS = "m|cm|ft|feet|foot|met(?:er|re)s?|yards?|degrees?|deg|°|seconds?|secs?|minutes?|steps?|paces|strides?";
const AMOUNT = new RegExp(`(?<![\\w.])${COUNT}[ -]?(?:${UNITS})(?!\\w)`, "i");
const OFTEN = /\b(?:twice|thrice|(?:two|three|four|five|six|seven|eight|nine|ten|\d+) times)\b/i;
const TURN = /\b(?:half|quarter|full)[ -](?:turn|circle)\b/i;

/** How long the words of a sentence say it takes; null where they say nothing of it. */
export const secondsInText = (text: string): number | null => reading(text, FPS, LONGEST).seconds;

/** What is kept of the numbers in sentences, and a remark for each that is left to the network. */
export function readings(segments: readonly Segment[], onPath: boolean): { kept: string[]; left: string[] } {
  const [kept, left]: [string[], string[]] = [[], []];
  for (const { text, seconds } of segments) {
    const { amount, seconds: said } = reading(text, FPS, LONGEST);
    if (amount && (!onPath || amount.kind === "count")) kept.push(`${described(amount)}, ${seconds} s`);
    else if (said !== null && !amount) kept.push(`${seconds} s`);
    else if (amount) left.push(`"${described(amount)}" gives way to the path.`);
    else {
      const found = [AMOUNT, OFTEN, TURN].flatMap((one) => one.exec(text)?.[0] ?? []);
      left.push(...found.map((one) => `"${one}" is left to the network; numbers are read in sentences of one action.`));
    }
  }
  return { kept, left: [...new Set(left)] };
}
