/** A project in the server's words: the structure of a timeline file and of a goal file. */

import { JOINTS } from "../body/skeleton";
import { type Person, type Project, type Vec3, FPS, length, round, toFrame } from "./model";
import { facings, timed } from "./path";
import { transitionOf } from "./timeline";

type Point = { time: number; position: number[] };
type JointGoal = { joint: string; points: Point[]; curve?: boolean };

export interface Goal {
  path?: { points: number[][]; times: number[]; facing?: number[] };
  joints?: JointGoal[];
}

export interface SegmentJson {
  text: string;
  seconds: number;
  transition?: number;
  goal?: Goal;
}

export interface TimelineJson {
  seed: number;
  segments: SegmentJson[];
  path?: Goal;
}

/** What is asked of a person over `seconds`, as a goal file has it; null: nothing. */
export function goalOf(person: Person, seconds: number): Goal | null {
  const goal: Goal = {};
  const path = person.path && timed(person.path, seconds);
  if (path) {
    const degrees = facings(path);
    goal.path = { points: path.points.map(({ x, z }) => [x, z]), times: [...path.times] };
    if (degrees) goal.path.facing = degrees;
  }
  const joints = [...held(person, seconds), ...single(person, seconds)];
  if (joints.length) goal.joints = joints;
  return goal.path || goal.joints ? goal : null;
}

/** The timeline of a project; the words of both people where they differ. */
export function timelineOf(project: Project, seed = project.seed): TimelineJson {
  const timeline: TimelineJson = {
    seed,
    segments: project.segments.map((one, index) => {
      const both = project.people.length > 1 && one.other.trim();
      const json: SegmentJson = { text: both ? `${one.text} :: ${one.other}` : one.text, seconds: one.seconds };
      if (index < project.segments.length - 1) json.transition = round(transitionOf(project, index));
      return json;
    }),
  };
  const person = project.people[asked(project)]!;
  const goal = goalOf(person, length(project));
  // Who has no path begins at the origin facing +Z, and what a first block asks is seen from there: the world.
  if (goal && !goal.path) timeline.segments[0]!.goal = goal;
  else if (goal) timeline.path = goal;
  return timeline;
}

/** A duet keeps to the goals of one person: the first who has any. */
export function asked(project: Project): number {
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
