/**
 * What a project is: everything that undo brings back and that a project file keeps.
 *
 * Metres, seconds and degrees; +Y up; a person who faces +Z has facing 0 and the left side at +X. All values are
 * immutable: an edit gives a new project.
 */

import type { Part } from "./tracks";

export const FPS = 20;
export const SHORTEST = 0.2;
export const LONGEST = 60;

export type Vec3 = readonly [number, number, number];
export type Range = readonly [number, number];

/** One prompted stretch. */
export interface Segment {
  readonly id: string;
  readonly text: string;
  /** What the second person does, where there is one and it does something else; empty: the same words. */
  readonly other: string;
  readonly seconds: number;
  /** Seconds shared with the next segment; null: one second, or half of the shorter one. */
  readonly transition: number | null;
  /** What a timeline file asks of this stretch and the page does not change: `guidance`, `goal`, `goals`. */
  readonly given: GoalJson | null;
}

/** Keys of a timeline file that are kept as they came and go out again. */
export type GoalJson = Readonly<Record<string, unknown>>;

export interface PathPoint {
  readonly x: number;
  readonly z: number;
  /** Seconds to stay here. */
  readonly stop: number;
  /** Degrees; null: along the path. */
  readonly facing: number | null;
}

export interface Path {
  readonly points: readonly PathPoint[];
  /** Metres per second; null: as fast as fills the time. */
  readonly speed: number | null;
  /** When each point is reached, for a way that was walked already; null: as `speed` and stops say. */
  readonly times: readonly number[] | null;
  /** The path of a timeline file, as long as nobody has changed it. */
  readonly given?: GoalJson | null;
}

/** A joint that is asked to be somewhere. */
export interface Target {
  readonly id: string;
  /** Index into the 22 joints. */
  readonly joint: number;
  readonly time: number;
  /** The joint stays there to this time; null: only at `time`. */
  readonly until: number | null;
  readonly position: Vec3;
}

/** A whole pose that is asked at one time, in the world. */
export interface Pose {
  readonly id: string;
  readonly name: string;
  readonly time: number;
  readonly positions: readonly Vec3[];
}

export const OTHER = "other";

/** A part of the body that does something of its own from one time to another. */
export interface Track {
  readonly id: string;
  readonly part: Part;
  /** What it does; empty: nothing of its own yet. */
  readonly text: string;
  /** A clip whose beginning it follows instead of words. */
  readonly clip: Clip | null;
  /** Where a head looks: a place, or the other person. */
  readonly look: Vec3 | typeof OTHER | null;
  /** Seconds: what is quicker is evened out; 0: nothing is. */
  readonly smooth: number;
  readonly from: number;
  readonly until: number;
}

/** What is asked of one person besides words. */
export interface Person {
  readonly path: Path | null;
  readonly targets: readonly Target[];
  readonly poses: readonly Pose[];
  readonly tracks: readonly Track[];
}

/** How a take was made whose blocks were drawn one after the other, as they changed. */
export const CHANGED = "changed";

/** A motion that the server holds. */
export interface Take {
  readonly motion: string;
  readonly seed: number;
  readonly seconds: number;
  readonly people: number;
  /** In words, how it was made: "drawn", "redrawn", "continued", ... */
  readonly how: string;
  /** What happens in it, as it was measured, and what is remarked on its words: a sentence each. */
  readonly told?: readonly string[];
  /** What is remarked on the words of single blocks. */
  readonly notes?: readonly Note[];
  /** Where one body is in the other. */
  readonly overlaps?: readonly Overlap[];
  /** The tracks that were laid over it (`trackKey`), and the motion under them. */
  readonly tracks?: readonly string[];
  readonly under?: string;
}

/** Seconds in which two bodies are in each other, and by how many metres at most. */
export interface Overlap {
  readonly begin: number;
  readonly end: number;
  readonly depth: number;
}

/** A remark on some words. */
export interface Note {
  readonly text: string;
  readonly line: string;
  /** Sentences that are known, the nearest first. */
  readonly instead: readonly string[];
}

/** A motion from a file, or one that was put aside. */
export interface Clip {
  readonly motion: string;
  readonly name: string;
  readonly seconds: number;
}

/** Version of the project file: 1 had no id and no revision. */
export const VERSION = 2;

/** Which project of a server, and which state of it; the server counts the revisions. */
export interface Stamp {
  readonly id: string;
  readonly revision: number;
}

/** A time that somebody wants to find again. */
export interface Marker {
  readonly id: string;
  readonly time: number;
  readonly name: string;
}

export interface Project {
  readonly version: typeof VERSION;
  readonly name: string;
  readonly seed: number;
  /** How many takes a draw gives: 1 or 4. */
  readonly count: number;
  readonly segments: readonly Segment[];
  /** One or two. */
  readonly people: readonly Person[];
  /** Stretches of `base` that stay as they are, sorted and apart; the rest is drawn between them. */
  readonly frozen: readonly Range[];
  readonly base: Take | null;
  /** Whose motion is drawn between them where there are two people: 0 or 1; null: everybody's. */
  readonly only: number | null;
  /** Whom the second person reacts to, if it does: a motion of the first. */
  readonly reactTo: Clip | null;
  readonly takes: readonly Take[];
  readonly kept: number;
  /** What `takes` were drawn from: `planKey` of that project. */
  readonly drawn: string;
  readonly clips: readonly Clip[];
  /** Sorted by time. */
  readonly markers: readonly Marker[];
  /** The user's own character, as the server knows it. */
  readonly character: { readonly id: string; readonly name: string } | null;
  /** What a timeline file asks of the whole and the page does not change: `guidance`, `start`, `path`. */
  readonly given: GoalJson | null;
}

let counter = 0;

/** A name that no other part of any project has. */
export function newId(): string {
  counter += 1;
  return `${Date.now().toString(36)}${counter.toString(36)}${Math.floor(Math.random() * 1296).toString(36)}`;
}

export const NO_CONSTRAINTS: Person = { path: null, targets: [], poses: [], tracks: [] };

export function segment(text: string, seconds: number): Segment {
  return { id: newId(), text, other: "", seconds, transition: null, given: null };
}

/** What somebody sees who opens the page for the first time. */
export function exampleProject(): Project {
  return {
    version: VERSION,
    name: UNTITLED,
    seed: 1,
    count: 1,
    segments: [segment("a person walks forward", 3.5), segment("a person waves with the right hand", 3)],
    people: [NO_CONSTRAINTS],
    frozen: [],
    base: null,
    only: null,
    reactTo: null,
    takes: [],
    kept: 0,
    drawn: "",
    clips: [],
    markers: [],
    character: null,
    given: null,
  };
}

/** Letters of a project's words that name it, and the name of one without words. */
const NAMED = 40;
const UNTITLED = "Untitled";

/** Whether anything is said in it. */
export function hasWords(project: Project): boolean {
  return project.segments.some((one) => one.text.trim());
}

/** The name that a project has by its words: those of its blocks, the person of the first one not repeated. */
export function wordsName({ segments }: Pick<Project, "segments">): string {
  const texts = segments.map((one) => one.text.trim()).filter(Boolean);
  const person = /^(an?|the) \S+ /i.exec(texts[0] ?? "")?.[0] ?? "";
  const rest = texts.map((text, index) =>
    index && person && text.startsWith(person) ? text.slice(person.length) : text,
  );
  return Array.from(rest.join(", ")).slice(0, NAMED).join("") || UNTITLED;
}

/** The next state of a project, named after its words as they are now unless somebody has named it. */
export function renamed(old: Project, next: Project): Project {
  if (next.segments === old.segments || next.name !== old.name) return next;
  const name = wordsName(next);
  return [UNTITLED, wordsName(old)].includes(old.name) && name !== old.name ? { ...next, name } : next;
}

/** A project in which nothing is said yet. */
export function blankProject(): Project {
  return { ...exampleProject(), segments: [segment("", 4)] };
}

/** Seconds of all segments. */
export function length(project: Project): number {
  return round(project.segments.reduce((sum, one) => sum + one.seconds, 0));
}

/** Where each segment begins, and at last the end of all. */
export function begins(segments: readonly Segment[]): number[] {
  const at = [0];
  for (const one of segments) at.push(round(at[at.length - 1]! + one.seconds));
  return at;
}

/** To the frame; times that add up stay on the frames. */
export function toFrame(seconds: number): number {
  return Math.round(seconds * FPS) / FPS;
}

/** Without the dust of binary fractions. */
export function round(value: number): number {
  return Math.round(value * 1000) / 1000;
}

export function clamp(value: number, low: number, high: number): number {
  return Math.min(Math.max(value, low), high);
}

export function keptTake(project: Project): Take | null {
  return project.takes[project.kept] ?? null;
}
