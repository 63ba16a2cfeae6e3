/**
 * A timeline file as a project. What the page can show and change becomes its own (a path by points, joints at times,
 * whole poses, two people); everything else of the file is kept as it is, and goes out again with the rest.
 */

import { JOINTS } from "../body/skeleton";
import type { Goal, JointGoal, Point } from "./goals";
import {
  type GoalJson,
  type Path,
  type Person,
  type Pose,
  type Project,
  type Segment,
  type Target,
  type Vec3,
  NO_CONSTRAINTS,
  exampleProject,
  newId,
  round,
} from "./model";
import { pathPoint } from "./path";

/** Seconds of a stretch where a file does not say. */
const SECONDS = 5;
const MARK = "::";

type Mapping = Record<string, unknown>;

/** A timeline's JSON, which the server has read as a timeline already; `person`: whose its goals are, 0 or 1. */
export function opened(found: Mapping, name: string, person = 0): Project {
  const { segments: rows, seed, transition, path, ...given } = found;
  const count = (rows as unknown[]).length;
  const segments = (rows as (string | Mapping)[]).map((row, index) =>
    segment(row, index < count - 1 ? transition : null),
  );
  const two = (rows as (string | Mapping)[]).some((row) =>
    String(typeof row === "string" ? row : row.text).includes(MARK),
  );
  const seconds = round(segments.reduce((sum, one) => sum + one.seconds, 0));
  const inFirst = segments.length === 1 && path === undefined && goalInWorld(segments[0]!.given);
  const asked = read(inFirst ? segments[0]!.given!.goal : path, seconds);
  if (inFirst) segments[0] = { ...segments[0]!, given: rest(segments[0]!.given!, "goal") };
  const kept = { ...given, ...(asked.kept === undefined ? {} : { path: asked.kept }) };
  return {
    ...exampleProject(),
    name,
    seed: typeof seed === "number" ? seed : 0,
    segments,
    people: two ? [0, 1].map((who) => (who === person ? asked.person : NO_CONSTRAINTS)) : [asked.person],
    given: Object.keys(kept).length ? kept : null,
  };
}

function segment(row: string | Mapping, shared: unknown): Segment {
  const { text, seconds = SECONDS, transition = shared, ...given } = typeof row === "string" ? { text: row } : row;
  const [first = "", second = ""] = String(text)
    .split(MARK)
    .map((part) => part.trim());
  return {
    id: newId(),
    text: first,
    other: second === first ? "" : second,
    seconds: seconds as number,
    transition: typeof transition === "number" ? transition : null,
    given: Object.keys(given).length ? given : null,
  };
}

/** What a first stretch asks is in the world where it says no start and no path of its own. */
function goalInWorld(given: GoalJson | null): boolean {
  const goal = given?.goal;
  return typeof goal === "object" && goal !== null && !("path" in goal) && !("start" in goal);
}

/** The part of a goal that the page shows and changes, and what is left of it. */
function read(goal: unknown, seconds: number): { person: Person; kept?: unknown } {
  if (typeof goal !== "object" || goal === null) return { person: NO_CONSTRAINTS, ...(goal ? { kept: goal } : {}) };
  const { path, joints = [], ...others } = goal as Goal;
  const line = path && pathOf(path as unknown as Mapping);
  const own = joints.filter(isOwn);
  const foreign = joints.filter((one) => !isOwn(one));
  const person = { ...NO_CONSTRAINTS, path: line ?? null, ...asks(own, seconds) };
  const kept: Mapping = { ...others };
  if (path && !line) kept.path = path;
  if (foreign.length) kept.joints = foreign;
  return { person, ...(Object.keys(kept).length ? { kept } : {}) };
}

/** A path by points; null for a drawing, a curve by name, a closed or an angular one. */
function pathOf(given: Mapping): Path | null {
  const { points, times, facing, ...more } = given;
  if (!Array.isArray(points) || Object.keys(more).length) return null;
  const facings = Array.isArray(facing) ? facing : points.map(() => facing);
  if (facing === "free" || (Array.isArray(facing) && facing.length !== points.length)) return null;
  return {
    points: (points as [number, number][]).map(([x, z], index) => ({
      ...pathPoint(x, z),
      facing: typeof facings[index] === "number" ? facings[index] : null,
    })),
    speed: null,
    times: Array.isArray(times) ? times : null,
    given,
  };
}

/** Whether a goal for a joint is one that the page has: places at times, or one place through time. */
function isOwn(goal: JointGoal): boolean {
  const { joint, points, curve = false, ...more } = goal;
  if (!JOINTS.includes(joint as (typeof JOINTS)[number]) || !Array.isArray(points) || Object.keys(more).length)
    return false;
  if (!points.every(({ position }) => position.every((one) => typeof one === "number"))) return false;
  return !curve || isHeld(goal);
}

function isHeld({ points }: JointGoal): boolean {
  const [first, last] = [points[0]!, points[1]!];
  return points.length === 2 && first.position.every((one, axis) => one === last.position[axis]);
}

/** Goals for joints as targets; places of all joints at one time are a pose. */
function asks(goals: readonly JointGoal[], seconds: number): Pick<Person, "targets" | "poses"> {
  const held = goals.filter((one) => one.curve).map((one) => target(one.joint, one.points[0]!, one.points[1]!.time));
  const points = goals
    .filter((one) => !one.curve)
    .flatMap((one) => one.points.map((point) => ({ joint: one.joint, point })));
  const times = [...new Set(points.map(({ point }) => point.time))];
  const poses = times.flatMap((time) => pose(time, points, held) ?? []);
  const single = points
    .filter(({ point }) => !poses.some((one) => one.time === point.time))
    .map(({ joint, point }) => target(joint, point, null));
  return { targets: [...held, ...single].filter((one) => one.time <= seconds), poses };
}

function pose(time: number, all: readonly { joint: string; point: Point }[], held: readonly Target[]): Pose | null {
  const positions = JOINTS.map((name, joint): Vec3 | null => {
    const own = all.find((one) => one.joint === name && one.point.time === time)?.point.position;
    const pinned = held.find((one) => one.joint === joint && one.time <= time && time <= one.until!);
    return own ? vec3(own) : (pinned?.position ?? null);
  });
  if (positions.some((one) => one === null)) return null;
  return { id: newId(), name: `pose at ${round(time)} s`, time, positions: positions as Vec3[] };
}

function target(joint: string, point: Point, until: number | null): Target {
  const index = JOINTS.indexOf(joint as (typeof JOINTS)[number]);
  return { id: newId(), joint: index, time: point.time, until, position: vec3(point.position) };
}

function vec3([x, y, z]: number[]): Vec3 {
  return [x!, y!, z!];
}

function rest(given: GoalJson, without: string): GoalJson | null {
  const left = Object.fromEntries(Object.entries(given).filter(([key]) => key !== without));
  return Object.keys(left).length ? left : null;
}
