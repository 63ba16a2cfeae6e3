/** A project in the server's words: the structure of a timeline file and of a goal file. */

import { JOINTS } from "../body/skeleton";
import {
  type Note,
  type Path,
  type Person,
  type Project,
  type Segment,
  type Vec3,
  FPS,
  keptTake,
  length,
  round,
  toFrame,
} from "./model";
import { facings, timed } from "./path";
import { transitionOf } from "./timeline";

export type Point = { time: number; position: number[] };
export type JointGoal = { joint: string; points: Point[]; curve?: boolean };

export interface PathGoal {
  points: number[][];
  times: number[];
  facing?: number[];
}

export interface Goal {
  path?: PathGoal;
  joints?: JointGoal[];
  /** What a file asks besides. */
  [key: string]: unknown;
}

export interface SegmentJson {
  text: string;
  seconds: number;
  transition?: number;
  goal?: Goal;
  [key: string]: unknown;
}

export interface TimelineJson {
  seed: number;
  segments: SegmentJson[];
  path?: Goal;
  [key: string]: unknown;
}

/** What is asked of a person over `seconds`, as a goal file has it; null: nothing. */
export function goalOf(person: Person, seconds: number): Goal | null {
  const goal: Goal = {};
  const path = person.path && pathGoal(person.path, seconds);
  if (path) goal.path = path;
  const joints = [...held(person, seconds), ...single(person, seconds)];
  if (joints.length) goal.joints = joints;
  return goal.path || goal.joints ? goal : null;
}

function pathGoal(path: Path, seconds: number): PathGoal | null {
  const given = path.given as unknown as Partial<PathGoal> | null | undefined;
  if (given && !(given.times && given.times.at(-1)! > seconds)) return given as PathGoal;
  const timedPath = timed(path, seconds);
  if (!timedPath) return null;
  const degrees = facings(timedPath);
  const points = timedPath.points.map(({ x, z }) => [x, z]);
  return { points, times: [...timedPath.times], ...(degrees ? { facing: degrees } : {}) };
}

/** The timeline of a project; the words of both people where there are two. */
export function timelineOf(project: Project, seed = project.seed): TimelineJson {
  const { path: kept, ...given } = project.given ?? {};
  const timeline: TimelineJson = {
    seed,
    ...given,
    segments: project.segments.map((one, index) => {
      const json: SegmentJson = { text: wordsOf(project, one), seconds: one.seconds };
      if (index < project.segments.length - 1) json.transition = round(transitionOf(project, index));
      return { ...json, ...one.given };
    }),
  };
  const person = project.people[constraintCount(project)]!;
  const goal = joinedGoals(goalOf(person, length(project)), kept);
  const [first] = timeline.segments;
  // Who has no path begins at the origin facing +Z, and what a first block asks is seen from there: the world.
  const inFirst = goal && !kept && !goal.path && !first!.goal && !first!.goals;
  if (inFirst) first!.goal = goal;
  else if (goal) timeline.path = goal as Goal;
  return timeline;
}

/** What is remarked on the words of a block, of one person or of both. */
export function notesOf(project: Project, one: Segment): readonly Note[] {
  const said = [one.text, one.other, wordsOf(project, one)].map((text) => text.trim());
  return keptTake(project)?.notes?.filter((note) => said.includes(note.text.trim())) ?? [];
}

/** What is asked of blocks that have no words yet, so that the others can be drawn. */
export const STANDS_STILL = "a person stands still";

function wordsOf(project: Project, one: Segment): string {
  const text = one.text.trim() ? one.text : STANDS_STILL;
  return project.people.length > 1 ? `${text} :: ${one.other.trim() || text}` : text;
}

/** What the page asks, and what a file asks that the page only keeps. */
function joinedGoals(own: Goal | null, kept: unknown): Goal | null {
  if (!kept || typeof kept !== "object") return own ?? (kept as Goal | null) ?? null;
  const joints = [...(own?.joints ?? []), ...((kept as Goal).joints ?? [])];
  return { ...own, ...(kept as Goal), ...(joints.length ? { joints } : {}) };
}

/** A duet keeps to the goals of one person: the first who has any. */
export function constraintCount(project: Project): number {
  return Math.max(
    project.people.findIndex((person) => goalOf(person, length(project)) !== null),
    0,
  );
}

/** Targets that hold through time ask for every frame of it. */
function held(person: Person, seconds: number): JointGoal[] {
  return person.targets.flatMap((target) => {
    const [from, to] = [within(target.time, seconds), within(target.until ?? target.time, seconds)];
    if (to - from < 1 / FPS) return [];
    const position = [...target.position];
    const points = [from, to].map((time) => ({ time, position }));
    return [{ joint: JOINTS[target.joint]!, points, curve: true }];
  });
}

/** Targets and poses of one moment, a list of points for each joint; a target goes before a pose. */
function single(person: Person, seconds: number): JointGoal[] {
  const places = new Map<number, Map<number, Vec3>>();
  const put = (joint: number, time: number, position: Vec3) => {
    if (!places.has(joint)) places.set(joint, new Map());
    places.get(joint)!.set(within(time, seconds), position);
  };
  for (const pose of person.poses) {
    pose.positions.forEach((position, joint) => {
      if (!isHeld(person, joint, pose.time)) put(joint, pose.time, position);
    });
  }
  for (const target of person.targets) if (target.until === null) put(target.joint, target.time, target.position);
  return [...places.entries()].map(([joint, at]) => ({
    joint: JOINTS[joint]!,
    points: [...at.entries()]
      .sort((a, b) => a[0] - b[0])
      .map(([time, position]) => ({ time, position: [...position] })),
  }));
}

function isHeld(person: Person, joint: number, time: number): boolean {
  return person.targets.some(
    (one) => one.joint === joint && one.until !== null && one.time <= time && time <= one.until,
  );
}

function within(time: number, seconds: number): number {
  return round(Math.min(Math.max(toFrame(time), 0), seconds));
}
