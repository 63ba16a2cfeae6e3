/** Edits of constraints besides words: a path, targets of joints, poses. `who` is 0 or 1. */

import {
  type Path,
  type PathPoint,
  type Pose,
  type Project,
  type Target,
  type Vec3,
  FPS,
  length,
  newId,
  round,
  toFrame,
} from "./model";
import { type MotionClip, facingAt, jointAt } from "../body/clip";
import { between } from "../body/posed";
import { PELVIS } from "../body/skeleton";
import { type Ground, pathPoint, simplified } from "./path";
import { changePerson } from "./timeline";

/** Seconds between the points of a path from a motion. */
const WAY_STEP = 0.5;

export function setPath(project: Project, who: number, path: Path | null): Project {
  return changePerson(project, who, (person) => (person.path === path ? person : { ...person, path }));
}

/** A line drawn by hand, as points; what it has of speed stays. */
export function drawPath(project: Project, who: number, line: readonly Ground[]): Project {
  const points = simplified(line).map(({ x, z }) => pathPoint(x, z));
  if (points.length < 2) return project;
  return setPath(project, who, { points, speed: project.people[who]?.path?.speed ?? null, times: null, given: null });
}

/** One more point at the end; the first one makes a path that begins at `start`. */
export function addPoint(project: Project, who: number, at: Ground, start: Ground): Project {
  const path = project.people[who]?.path ?? { points: [pathPoint(start.x, start.z)], speed: null };
  return setPath(project, who, { ...path, times: null, given: null, points: [...path.points, pathPoint(at.x, at.z)] });
}

export function changePoint(project: Project, who: number, index: number, part: Partial<PathPoint>): Project {
  const path = project.people[who]?.path;
  if (!path?.points[index]) return project;
  const points = path.points.map((one, n) => (n === index ? { ...one, ...part } : one));
  return setPath(project, who, { ...path, points, given: null, times: part.stop === undefined ? path.times : null });
}

export function removePoint(project: Project, who: number, index: number): Project {
  const path = project.people[who]?.path;
  if (!path?.points[index]) return project;
  const points = path.points.filter((_, n) => n !== index);
  return setPath(project, who, points.length < 2 ? null : { ...path, times: null, given: null, points });
}

export function setSpeed(project: Project, who: number, speed: number | null): Project {
  const path = project.people[who]?.path;
  return path ? setPath(project, who, { ...path, speed, times: null, given: null }) : project;
}

/**
 * The first person with targets or poses but without a path, or -1: over several blocks the server has to
 * know the way to say where a joint is.
 */
export function personWithoutPath(project: Project): number {
  if (project.segments.length < 2 || hasPath(project.given?.path)) return -1;
  return project.people.findIndex((one) => !one.path && (one.targets.length > 0 || one.poses.length > 0));
}

function hasPath(goal: unknown): boolean {
  return typeof goal === "string" || (typeof goal === "object" && goal !== null && "path" in goal);
}

/** The path of a motion, with its times and facings. */
export function pathFromMotion(project: Project, who: number, clip: MotionClip): Project {
  const seconds = Math.min(length(project), clip.seconds - 1 / clip.fps);
  const count = Math.max(Math.round(seconds / WAY_STEP), 1);
  const times = Array.from({ length: count + 1 }, (_, n) => toFrame((seconds * n) / count));
  const points = times.map((time) => {
    const [x, , z] = jointAt(clip, who, PELVIS, time);
    return { ...pathPoint(x, z), facing: round(facingAt(clip, who, time)) };
  });
  return setPath(project, who, { points, speed: null, times, given: null });
}

/** Set a target of a joint at a time: its target there moves, or a new one with this name appears. */
export function setTarget(
  project: Project,
  who: number,
  joint: number,
  time: number,
  position: Vec3,
  id = newId(),
): Project {
  const place = rounded(position);
  return changePerson(project, who, (person) => {
    const there = person.targets.find((one) => one.joint === joint && covers(one, time));
    if (!there) {
      return {
        ...person,
        targets: [...person.targets, { id, joint, time: round(time), until: null, position: place }],
      };
    }
    return { ...person, targets: person.targets.map((one) => (one === there ? { ...one, position: place } : one)) };
  });
}

export function targetAt(project: Project, who: number, joint: number, time: number): Target | null {
  return project.people[who]?.targets.find((one) => one.joint === joint && covers(one, time)) ?? null;
}

export function changeTarget(project: Project, who: number, id: string, part: Partial<Target>): Project {
  return changePerson(project, who, (person) => {
    const old = person.targets.find((one) => one.id === id);
    if (!old) return person;
    const next = { ...old, ...part, ...(part.position ? { position: rounded(part.position) } : {}) };
    if (next.until !== null && next.until <= next.time) next.until = null;
    return { ...person, targets: person.targets.map((one) => (one === old ? next : one)) };
  });
}

/** Move a target in time, with the stretch it is pinned for. */
export function shiftTarget(project: Project, who: number, id: string, time: number): Project {
  const target = project.people[who]?.targets.find((one) => one.id === id);
  if (!target) return project;
  const last = length(project) - ((target.until ?? target.time) - target.time);
  const to = Math.min(Math.max(round(time), 0), last);
  if (to === target.time) return project;
  return changeTarget(project, who, id, {
    time: to,
    until: target.until === null ? null : round(target.until + to - target.time),
  });
}

export function removeTarget(project: Project, who: number, id: string): Project {
  return changePerson(project, who, (person) => ({
    ...person,
    targets: person.targets.filter((one) => one.id !== id),
  }));
}

/** Add a whole pose at a time; it replaces one of the same frame. */
export function setPose(
  project: Project,
  who: number,
  name: string,
  time: number,
  positions: readonly Vec3[],
): Project {
  const pose: Pose = { id: newId(), name, time: round(time), positions };
  return changePerson(project, who, (person) => ({
    ...person,
    poses: [...person.poses.filter((one) => Math.abs(one.time - time) >= 0.5 / FPS), pose],
  }));
}

/** The pose at a time, if there is one. */
export function poseNear(project: Project, who: number, time: number): Pose | undefined {
  return project.people[who]?.poses.find((one) => Math.abs(one.time - time) < 0.5 / FPS);
}

/** `count` poses evenly between one and the next in time. */
export function fillPoses(project: Project, who: number, id: string, count: number): Project {
  const [from, to] = neighbours(project, who, id);
  if (!from || !to) return project;
  return between(from.positions, to.positions, count).reduce((now, positions, index) => {
    const time = toFrame(from.time + ((to.time - from.time) * (index + 1)) / (count + 1));
    const isFree = time > from.time && time < to.time && !poseNear(now, who, time);
    return isFree ? setPose(now, who, "in between", time, positions) : now;
  }, project);
}

/** A pose and the next one in time. */
export function neighbours(project: Project, who: number, id: string): (Pose | undefined)[] {
  const poses = [...(project.people[who]?.poses ?? [])].sort((a, b) => a.time - b.time);
  const index = poses.findIndex((one) => one.id === id);
  return index < 0 ? [] : [poses[index], poses[index + 1]];
}

export function changePose(project: Project, who: number, id: string, part: Partial<Pose>): Project {
  return changePerson(project, who, (person) => ({
    ...person,
    poses: person.poses.map((one) => (one.id === id ? { ...one, ...part } : one)),
  }));
}

export function removePose(project: Project, who: number, id: string): Project {
  return changePerson(project, who, (person) => ({ ...person, poses: person.poses.filter((one) => one.id !== id) }));
}

/** A pose moved along the floor: its pelvis is over `at`. */
export function moveTo(positions: readonly Vec3[], at: Ground): Vec3[] {
  const [x, , z] = positions[0]!;
  return positions.map(([px, y, pz]) => rounded([px - x + at.x, y, pz - z + at.z]));
}

function covers(target: Target, time: number): boolean {
  const half = 0.5 / FPS;
  return time >= target.time - half && time <= (target.until ?? target.time) + half;
}

function rounded([x, y, z]: Vec3): Vec3 {
  return [round(x), round(y), round(z)];
}
