/**
 * Numbers with units in the words of one action: how far, how many steps, how much of a turn, how long, how often
 * (`motionloom.goals.amounts`). Tables and patterns are Python's own: `tools/write_words.py` writes words.json.
 */

import { rounded } from "./turns";
import tables from "./words.json";

export type Counted = keyof typeof tables.strokes;
export type Direction = "forward" | "backward" | "left" | "right";

export interface Amount {
  readonly kind: "turn" | "way" | "steps" | "arc" | "count";
  /** Degrees of a turn or an arc, metres of a way, number of steps or repetitions. */
  readonly size: number;
  /** Where somebody goes; of turns and arcs the side, of repetitions the limb's. */
  readonly direction: Direction;
  /** Metres that the pelvis goes, and metres per second. */
  readonly metres: number;
  readonly speed: number;
  /** Whether an arc is walked backwards. */
  readonly backward: boolean;
  readonly of: Counted | null;
  /** Whether repetitions stay in one place. */
  readonly inPlace: boolean;
}

/** Metres: of a circle that is walked where its size is not said. */
export const RADIUS = 1;
const [MOST_DEGREES, MOST_STEPS, MOST_METRES, MOST_SECONDS, MOST_TIMES, WALKING] = [720, 40, 200, 60, 12, 1.1];

type Pattern = keyof typeof tables.patterns;
const PATTERNS = Object.fromEntries(
  Object.entries(tables.patterns).map(([name, source]) => [name, new RegExp(source, "g")]),
) as Record<Pattern, RegExp>;
const BASES = new Map(
  Object.entries(tables.verbs).flatMap(([base, forms]) => forms.split(" ").map((form) => [form, base] as const)),
);
const listed = (words: string): ReadonlySet<string> => new Set(words.split(" "));
const [TURNING, GOING, STEPPING] = [listed(tables.turning), listed(tables.going), listed(tables.stepping)];
const RUNNING = listed(tables.running);
/** What may go with a way, and kinds of actions whose numbers are no ways: jumps, blows, dances. */
const [BESIDE, IN_PLACE] = [listed("stop halt track return keep continue open place"), listed(tables.in_place)];
const PACES: Readonly<Record<string, number>> = tables.paces;
const UNITS: Readonly<Record<string, number>> = tables.units;
const NUMBER = "(\\d+(?:\\.\\d+)?)";
const SMALL_STEPS = listed("small tiny short baby little");
const LARGE_STEPS = listed("big large long giant huge");

const all = (name: Pattern, phrase: string): RegExpMatchArray[] => [...phrase.matchAll(PATTERNS[name])];
const first = (name: Pattern, phrase: string): RegExpMatchArray | undefined => all(name, phrase)[0];

/** A text with its numbers in digits, in small letters where `lower`: "three and a half" becomes 3.5. */
export function inDigits(text: string, lower = true): string {
  const phrase = lower ? text.toLowerCase().replaceAll(",", " ").split(/\s+/).filter(Boolean).join(" ") : text;
  const [small, tens] = [tables.small as Record<string, number>, tables.tens as Record<string, number>];
  const below = (words: string): number =>
    words.split(/[ -]/).reduce((sum, one) => sum + (small[one] ?? tens[one] ?? 0), 0);
  return phrase
    .replace(PATTERNS.number_words, (...found) => {
      const { plain, hundreds, rest } = found.at(-1) as Record<string, string | undefined>;
      return String(plain ? below(plain) : 100 * (small[hundreds!] ?? 1) + (rest ? below(rest) : 0));
    })
    .replace(PATTERNS.and_a_half, (_, number) => String(Number(number) + 0.5))
    .replace(/\bhalf an? (?=m(?:et|in)|second|foot|yard)/g, "0.5 ")
    .replace(/\ba couple of (?=m(?:et|in)|second|feet|yard|step)|\ba pair of (?=step)/g, "2 ")
    .replace(/\b(?:about|around|approximately|roughly|exactly|some) (?=\d)/g, "")
    .replace(/\bfor an? (?=minute\b|(?:full |whole )(?:minute|second)\b)(?:full |whole )?/g, "for 1 ");
}

/** What the words of one action ask for in numbers; null without. */
export function readAmount(text: string): Amount | null {
  let phrase = inDigits(text);
  const verbs = new Set(
    (phrase.match(/[a-z]+/g) ?? []).flatMap((word) => (word === "left" ? [] : (BASES.get(word) ?? []))),
  );
  phrase = phrase.replace(PATTERNS.ages, " ");
  const times = repetitions(phrase);
  if (times) return times;
  if (!verbs.size || has(verbs, IN_PLACE)) return null;
  phrase = phrase.replace(PATTERNS.steps_often, "$1 $3 steps$2");
  return turn(phrase, verbs) ?? arc(phrase, verbs) ?? steps(phrase, verbs) ?? way(phrase, verbs);
}

/** The seconds that "for ten seconds" asks for; null without, and beyond a minute. */
export function readSeconds(text: string): number | null {
  const found = all("seconds", inDigits(text));
  if (found.length !== 1) return null;
  const seconds = Number(found[0]![1]) * (found[0]![2]!.startsWith("min") ? 60 : 1);
  return seconds >= 0.2 && seconds <= MOST_SECONDS ? seconds : null;
}

const NEXT = /(?:[,;.]|\band|\bthen|\bbefore|\bafter)\s+(?:(?:and|then|also)\s+|\w+ly\s+)*([a-z]+)/g;
const ENDS = listed("stop halt pause");

/** What only ends each of several repetitions: "squats down and comes back up three times". */
const COMES_UP = /\band (?:stand|come|get|go|rise|straighten)(?:e?s)? (?:right |straight )?(?:back )?up\b/;

/** Whether a sentence says several actions one after the other, or may; a stop is only the end of one. */
export function isSeveral(text: string): boolean {
  const words = text.toLowerCase().trim();
  const phrase = inDigits(words).search(PATTERNS.often) < 0 ? words : words.replace(COMES_UP, "");
  const next = [...phrase.matchAll(NEXT)].map(([, word]) => BASES.get(word!));
  return (
    /\bthen\b|\b(?:moments?|seconds?|instant|while|bit) later\b|[;.]\s+\S/.test(phrase) ||
    next.some((verb) => verb !== undefined && !ENDS.has(verb))
  );
}

/** The words of one stroke of what is counted: "a person jumps" of "a person jumps three times". */
export function once(text: string): string {
  const phrase = inDigits(text, false);
  let less = phrase.replace(PATTERNS.often, "");
  if (less === phrase) less = phrase.replace(new RegExp(`\\b${NUMBER} (?=(?:[a-z]+ )?[a-z]+)`), "");
  return less
    .trim()
    .split(/\s+/)
    .join(" ")
    .replace(/^[ ,]+|[ ,]+$/g, "");
}

/** In words: "a turn of 90 degrees to the left". */
export function described({ kind, size, direction, backward, of }: Amount): string {
  if (kind === "count") return `${size} ${size > 1 ? of! : tables.single[of!]}`;
  if (kind === "turn") return `a turn of ${size} degrees to the ${direction}`;
  if (kind === "arc") return `an arc of ${size} degrees ${backward ? "backwards " : ""}to the ${direction}`;
  const where = direction === "left" || direction === "right" ? `to the ${direction}` : direction;
  return kind === "steps" ? `${size} step${size > 1 ? "s" : ""} ${where}` : `${size} m ${where}`;
}

const has = (some: ReadonlySet<string>, others: ReadonlySet<string>): boolean =>
  [...some].some((one) => others.has(one));

function amount(kind: Amount["kind"], size: number, direction: Direction, more: Partial<Amount> = {}): Amount {
  return { kind, size, direction, metres: 0, speed: 0, backward: false, of: null, inPlace: false, ...more };
}

const sideways = (side: string): Direction => (side === "left" ? "left" : "right");
const often = (word: string, number: string | undefined): number =>
  ({ once: 1, twice: 2, thrice: 3 })[word] ?? Number(number);
/** How often it is said that something is done, "at once" aside. */
const oftenIn = (phrase: string): RegExpMatchArray[] => all("often", phrase.replace(PATTERNS.often_kept, " "));

function repetitions(phrase: string): Amount | null {
  const [times, many] = [oftenIn(phrase), all("many", phrase)];
  if (times.length + many.length !== 1 || first("counts_another", phrase)) return null;
  let kinds = (Object.entries(tables.counted) as [Counted, string][])
    .filter(([, words]) => new RegExp(`\\b(?:${words})\\b`).test(phrase))
    .map(([what]) => what);
  if (kinds.includes("jumping jacks")) kinds = kinds.filter((what) => what !== "jumps");
  const size = many[0] ? Number(many[0][1]) : often(times[0]![1]!, times[0]![2]);
  if (kinds.length !== 1 || !Number.isInteger(size) || size < 1 || size > MOST_TIMES) return null;
  const [side, of] = [sideOf(phrase), kinds[0]!];
  const inPlace = ["jumps", "hops"].includes(of!) && !first("travels", phrase.replace(PATTERNS.on_one_leg, ""));
  return amount("count", size, side ? sideways(side) : "forward", { of, inPlace });
}

function turn(phrase: string, verbs: ReadonlySet<string>): Amount | null {
  const still = phrase.replace(PATTERNS.held, "");
  if (!has(verbs, TURNING) || first("body", still) || has(verbs, listed("throw look"))) return null;
  const [found, part] = [all("degrees", phrase), first("part_of_turn", phrase)];
  const [whole, times] = [first("turns_often", phrase), oftenIn(phrase)[0]];
  if (found.length > 1 || Number(found.length > 0) + Number(!!part) + Number(!!(whole ?? times)) !== 1) return null;
  const parts: Record<string, number> = { half: 180, "0.5": 180, quarter: 90, full: 360 };
  const degrees = whole
    ? 360 * Number(whole[1])
    : times
      ? 360 * often(times[1]!, times[2])
      : found[0]
        ? Number(found[0][1])
        : (parts[part![1]!] ?? 270);
  const named = /\b(?:left|right)\b/.test(phrase);
  const side = sideOf(phrase) || (degrees % 180 === 0 && !named ? "left" : "");
  const goes = [...verbs].some((verb) => GOING.has(verb) && verb !== "step" && verb !== "back");
  if (!side || degrees < 5 || degrees > MOST_DEGREES || goes) return null;
  return amount("turn", degrees, sideways(side));
}

function arc(phrase: string, verbs: ReadonlySet<string>): Amount | null {
  const [part, circle] = [first("arc", phrase), first("circle", phrase)];
  const side =
    sideOf(phrase) || (!part && circle && !has(verbs, RUNNING) && !/\b(?:left|right)\b/.test(phrase) ? "left" : "");
  if (!(part ?? circle) || !side || !has(verbs, GOING) || first("body", phrase.replace(PATTERNS.held, ""))) return null;
  const size = part?.[1] ?? "full";
  const degrees = size === "quarter" ? 90 : ["half", "semi", "0.5"].includes(size) ? 180 : 360;
  const metres = (RADIUS * degrees * Math.PI) / 180;
  return amount("arc", degrees, sideways(side), { metres, speed: pace(phrase, verbs), backward: isBackward(phrase) });
}

function steps(phrase: string, verbs: ReadonlySet<string>): Amount | null {
  const found = all("steps", phrase);
  if (found.length !== 1 || !has(verbs, STEPPING) || first("else", phrase)) return null;
  const [[, number, size = ""], direction] = [found[0]!, directionOf(phrase, true)];
  const count = number ? Number(number) : 1;
  if (!direction || !Number.isInteger(count) || count < 1 || count > MOST_STEPS) return null;
  const share = SMALL_STEPS.has(size) ? 0.6 : LARGE_STEPS.has(size) ? 1.3 : 1;
  const stride = (direction === "forward" ? 0.62 : 0.4) * share;
  const seconds = direction !== "forward" || isSlow(phrase) ? 0.5 : verbs.has("run") ? 0.4 : 0.45;
  return amount("steps", count, direction, { metres: count * stride, speed: stride / seconds });
}

function way(phrase: string, verbs: ReadonlySet<string>): Amount | null {
  const found = all("way", phrase);
  const direction = directionOf(phrase, verbs.has("move") || verbs.has("step"));
  if (found.length !== 1 || !direction || !has(verbs, GOING) || first("else", phrase)) return null;
  if ([...verbs].some((verb) => !GOING.has(verb) && !BESIDE.has(verb))) return null;
  const [, number, unit] = found[0]!;
  const exact = Number(number) * (UNITS[unit!] ?? UNITS[unit!.replace(/s$/, "")]!);
  if (exact < 0.2 || exact > MOST_METRES) return null;
  const metres = rounded(exact * 1000) / 1000;
  return amount("way", metres, direction, { metres, speed: pace(phrase, verbs) });
}

function pace(phrase: string, verbs: ReadonlySet<string>): number {
  let found = PACES[[...verbs].find((verb) => verb in PACES) ?? ""] ?? WALKING;
  const direction = directionOf(phrase, false);
  if (isBackward(phrase)) found *= 0.65;
  else if (direction === "left" || direction === "right") found = Math.min(found, 0.7);
  if (isSlow(phrase)) return 0.65 * found;
  return /\b(?:quickly|quick|fast|briskly|rapidly|hastily)\b/.test(phrase) ? 1.35 * found : found;
}

const isSlow = (phrase: string): boolean => /\b(?:slowly|slow|carefully|careful|cautiously|gently)\b/.test(phrase);
const isBackward = (phrase: string): boolean =>
  /\b(?:backwards?|(?<!his )(?<!her )(?<!its )(?<!their )back|in reverse|rearwards?)\b/.test(phrase);

/** The one side that is said, seen from above for clockwise; empty for none and for both. */
function sideOf(phrase: string): string {
  if (/\b(?:counter|anti)[ -]?clockwise\b/.test(phrase)) return "left";
  if (/\bclockwise\b/.test(phrase)) return "right";
  const found = phrase.matchAll(/\b(left|right)(?!(?:[ -]handed| after| before| away| in front))(?:wards?)?\b/g);
  const sides = new Set([...found].map(([, side]) => side!));
  return sides.size === 1 ? [...sides][0]! : "";
}

/** Where a way leads; null where that is not clear. `aside`: a side alone is enough for a step to it. */
function directionOf(phrase: string, aside: boolean): Direction | null {
  const [back, side, named] = [isBackward(phrase), sideOf(phrase), /\b(?:left|right)\b/.test(phrase)];
  const across = /\b(?:sideways?|side[ -]?steps?|sidestepping|side steps?|laterally)\b/.test(phrase);
  if (across || (aside && named)) return !side || back ? null : sideways(side);
  if (named || (back && /\bforwards?\b/.test(phrase))) return null;
  return back ? "backward" : "forward";
}
