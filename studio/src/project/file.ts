/** A project as one file, and back. A file may come from anybody: it is checked before anything is made of it. */

import { JOINTS } from "../body/skeleton";
import { SMOOTHEST, isPart } from "./tracks";
import {
  type GoalJson,
  type Project,
  type Stamp,
  type Track,
  FPS,
  LONGEST,
  SHORTEST,
  OTHER,
  VERSION,
  exampleProject,
} from "./model";

export const SUFFIX = ".loom.json";
const MOST_SEGMENTS = 500;
const MOST_POINTS = 2000;
const MOST_GIVEN = 2e6;

export class ProjectError extends Error {}

export function written(project: Project, stamp: Stamp): string {
  return JSON.stringify(filed(project, stamp), null, 1);
}

/** What a project file holds. */
export function filed(project: Project, { id, revision }: Stamp): Record<string, unknown> {
  return { format: "motionloom studio", ...project, id, revision };
}

/** Which project a file is of; null: it does not say, as files of version 1. */
export function stampOf(json: unknown): Stamp | null {
  const { id, revision } = (json ?? {}) as Mapping;
  const isStamp = typeof id === "string" && /^[\w-]{1,80}$/.test(id) && Number.isSafeInteger(revision);
  return isStamp ? { id, revision: revision as number } : null;
}

/** Read what `written` wrote; raises `ProjectError` with a sentence. */
export function read(text: string): Project {
  let json: unknown;
  try {
    json = JSON.parse(text);
  } catch {
    throw new ProjectError("This is no project file: it is not JSON; choose a file that the studio saved.");
  }
  return checked(json);
}

/** The project in a parsed value, with what is missing as in an empty one. */
export function checked(found: unknown): Project {
  const top = mapping(found, "the project");
  if (top.version !== 1 && top.version !== VERSION)
    throw new ProjectError(`The project has version ${shown(top.version)}; this page reads versions 1 to ${VERSION}.`);
  const empty = exampleProject();
  const people = list(top.people ?? empty.people, "people", 2).map((one, index) => person(one, `people[${index}]`));
  if (!people.length) throw new ProjectError("The project has no people; it needs one or two.");
  const segments = list(top.segments, "segments", MOST_SEGMENTS).map((one, index) =>
    segment(one, `segments[${index}]`),
  );
  if (!segments.length) throw new ProjectError("The project has no segments; it needs at least one.");
  const takes = list(top.takes ?? [], "takes", 16).map((one, index) => take(one, `takes[${index}]`));
  return {
    version: VERSION,
    name: word(top.name ?? empty.name, "name"),
    seed: number(top.seed ?? 1, "seed", 0, 2 ** 31),
    count: number(top.count ?? 1, "count", 1, 8),
    segments,
    people,
    frozen: list(top.frozen ?? [], "frozen", 100).map((one, index) => {
      const [from, to] = numbers(one, `frozen[${index}]`, 2);
      return [from!, to!] as const;
    }),
    base: top.base ? take(top.base, "base") : null,
    only: top.only == null ? null : number(top.only, "only", 0, 1),
    reactTo: top.reactTo ? clip(top.reactTo, "reactTo") : null,
    takes,
    kept: Math.min(number(top.kept ?? 0, "kept", 0, 16), Math.max(takes.length - 1, 0)),
    drawn: typeof top.drawn === "string" ? top.drawn : "",
    clips: list(top.clips ?? [], "clips", 100).map((one, index) => clip(one, `clips[${index}]`)),
    markers: list(top.markers ?? [], "markers", MOST_POINTS).map((one, index) => marker(one, `markers[${index}]`)),
    character: top.character ? character(top.character) : null,
    given: goalOf(top.given, "given"),
  };
}

type Mapping = Record<string, unknown>;

function marker(json: unknown, name: string) {
  const one = mapping(json, name);
  return {
    id: word(one.id, `${name}.id`),
    time: number(one.time, `${name}.time`, 0, LONGEST * MOST_SEGMENTS),
    name: word(one.name ?? "", `${name}.name`),
  };
}

function segment(json: unknown, name: string) {
  const one = mapping(json, name);
  return {
    id: word(one.id, `${name}.id`),
    text: word(one.text, `${name}.text`),
    other: word(one.other ?? "", `${name}.other`),
    seconds: number(one.seconds, `${name}.seconds`, SHORTEST, LONGEST),
    transition: one.transition == null ? null : number(one.transition, `${name}.transition`, 0.05, LONGEST / 2),
    given: goalOf(one.given, `${name}.given`),
  };
}

/** Parts of a timeline file that the server reads and the page only keeps. */
function goalOf(json: unknown, name: string): GoalJson | null {
  if (json == null) return null;
  if (JSON.stringify(json).length > MOST_GIVEN)
    throw new ProjectError(`${name} holds more than ${MOST_GIVEN / 1e6} million characters; shorten it.`);
  return mapping(json, name);
}

function person(json: unknown, name: string) {
  const entries = mapping(json, name);
  const path = entries.path ? mapping(entries.path, `${name}.path`) : null;
  return {
    path: path && {
      times: path.times ? numbers(path.times, `${name}.path.times`, list(path.points, name, MOST_POINTS).length) : null,
      speed: path.speed == null ? null : number(path.speed, `${name}.path.speed`, 0.05, 12),
      given: goalOf(path.given, `${name}.path.given`),
      points: list(path.points, `${name}.path.points`, MOST_POINTS).map((one, index) => {
        const at = `${name}.path.points[${index}]`;
        const point = mapping(one, at);
        return {
          x: number(point.x, `${at}.x`, -1000, 1000),
          z: number(point.z, `${at}.z`, -1000, 1000),
          stop: number(point.stop ?? 0, `${at}.stop`, 0, LONGEST),
          facing: point.facing == null ? null : number(point.facing, `${at}.facing`, -3600, 3600),
        };
      }),
    },
    targets: list(entries.targets ?? [], `${name}.targets`, MOST_POINTS).map((one, index) => {
      const at = `${name}.targets[${index}]`;
      const target = mapping(one, at);
      return {
        id: word(target.id, `${at}.id`),
        joint: number(target.joint, `${at}.joint`, 0, JOINTS.length - 1),
        time: number(target.time, `${at}.time`, 0, 3600),
        until: target.until == null ? null : number(target.until, `${at}.until`, 0, 3600),
        position: place(target.position, `${at}.position`),
      };
    }),
    poses: list(entries.poses ?? [], `${name}.poses`, 200).map((one, index) => {
      const at = `${name}.poses[${index}]`;
      const pose = mapping(one, at);
      const positions = list(pose.positions, `${at}.positions`, JOINTS.length).map((row) =>
        place(row, `${at}.positions`),
      );
      if (positions.length !== JOINTS.length)
        throw new ProjectError(`${at}.positions has ${positions.length} places; give ${JOINTS.length}.`);
      return {
        id: word(pose.id, `${at}.id`),
        name: word(pose.name, `${at}.name`),
        time: number(pose.time, `${at}.time`, 0, 3600),
        positions,
      };
    }),
    tracks: list(entries.tracks ?? [], `${name}.tracks`, 200).map((one, index) =>
      track(one, `${name}.tracks[${index}]`),
    ),
  };
}

function track(json: unknown, name: string): Track {
  const one = mapping(json, name);
  const part = word(one.part, `${name}.part`);
  if (!isPart(part)) throw new ProjectError(`${name}.part is ${shown(part)}, which names no part of the body.`);
  return {
    id: word(one.id, `${name}.id`),
    part,
    text: word(one.text ?? "", `${name}.text`),
    clip: one.clip ? clip(one.clip, `${name}.clip`) : null,
    look: one.look === OTHER ? OTHER : one.look == null ? null : place(one.look, `${name}.look`),
    smooth: number(one.smooth ?? 0, `${name}.smooth`, 0, SMOOTHEST),
    from: number(one.from, `${name}.from`, 0, 3600),
    until: number(one.until, `${name}.until`, 0, 3600),
  };
}

function take(json: unknown, name: string) {
  const entries = mapping(json, name);
  return {
    motion: motionId(entries.motion, `${name}.motion`),
    seed: number(entries.seed ?? 0, `${name}.seed`, 0, 2 ** 62),
    seconds: number(entries.seconds, `${name}.seconds`, 1 / FPS, 86400),
    people: number(entries.people ?? 1, `${name}.people`, 1, 2),
    how: word(entries.how ?? "drawn", `${name}.how`),
    ...(entries.told == null
      ? {}
      : { told: list(entries.told, `${name}.told`, 100).map((one) => word(one, `${name}.told`)) }),
    ...(entries.overlaps == null
      ? {}
      : {
          overlaps: list(entries.overlaps, `${name}.overlaps`, 10_000).map((one) => overlap(one, `${name}.overlaps`)),
        }),
    ...(entries.tracks == null
      ? {}
      : { tracks: list(entries.tracks, `${name}.tracks`, 400).map((one) => word(one, `${name}.tracks`)) }),
    ...(entries.under == null ? {} : { under: motionId(entries.under, `${name}.under`) }),
    ...(entries.notes == null
      ? {}
      : { notes: list(entries.notes, `${name}.notes`, 200).map((one, index) => note(one, `${name}.notes[${index}]`)) }),
  };
}

function overlap(json: unknown, name: string) {
  const entries = mapping(json, name);
  const [begin, end, depth] = ["begin", "end", "depth"].map((key) => number(entries[key], `${name}.${key}`, 0, 86400));
  return { begin: begin!, end: end!, depth: depth! };
}

function note(json: unknown, name: string) {
  const entries = mapping(json, name);
  return {
    text: word(entries.text, `${name}.text`),
    line: word(entries.line, `${name}.line`),
    instead: list(entries.instead ?? [], `${name}.instead`, 10).map((one) => word(one, `${name}.instead`)),
  };
}

function clip(json: unknown, name: string) {
  const given = mapping(json, name);
  return {
    motion: motionId(given.motion, `${name}.motion`),
    name: word(given.name, `${name}.name`),
    seconds: number(given.seconds, `${name}.seconds`, 1 / FPS, 86400),
  };
}

function character(found: unknown) {
  const given = mapping(found, "character");
  return { id: motionId(given.id, "character.id"), name: word(given.name, "character.name") };
}

/** It becomes a part of an address, so it is letters, digits, dashes and underscores. */
function motionId(value: unknown, name: string): string {
  const id = word(value, name);
  if (!/^[\w-]{1,80}$/.test(id))
    throw new ProjectError(`${name} is ${shown(value)}, which names no motion of the server.`);
  return id;
}

function place(value: unknown, name: string) {
  const [x, y, z] = numbers(value, name, 3);
  return [x!, y!, z!] as const;
}

function mapping(value: unknown, name: string): Mapping {
  if (typeof value !== "object" || value === null || Array.isArray(value))
    throw new ProjectError(`${name} must be a mapping; got ${shown(value)}.`);
  return value as Mapping;
}

function list(value: unknown, name: string, most: number): unknown[] {
  if (!Array.isArray(value)) throw new ProjectError(`${name} must be a list; got ${shown(value)}.`);
  if (value.length > most) throw new ProjectError(`${name} has ${value.length} entries; at most ${most} are read.`);
  return value;
}

function numbers(value: unknown, name: string, count: number): number[] {
  const found = list(value, name, count).map((one) => number(one, name, -1e5, 1e5));
  if (found.length !== count) throw new ProjectError(`${name} has ${found.length} numbers; give ${count}.`);
  return found;
}

function number(value: unknown, name: string, low: number, high: number): number {
  if (typeof value !== "number" || !(value >= low && value <= high))
    throw new ProjectError(`${name} must be ${low} to ${high}; got ${shown(value)}.`);
  return value;
}

function word(value: unknown, name: string): string {
  if (typeof value !== "string" || value.length > 20_000)
    throw new ProjectError(`${name} must be text of at most 20,000 characters; got ${shown(value)}.`);
  return value;
}

function shown(value: unknown): string {
  return value === undefined ? "nothing" : String(JSON.stringify(value)).slice(0, 60);
}
