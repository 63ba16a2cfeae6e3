/** Edits of what is asked besides words: a path, targets of joints, poses. `who` is 0 or 1. */

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
} from "./model";
import { type Ground, pathPoint, simplified } from "./path";
import { changePerson } from "./timeline";

export function setPath(project: Project, who: number, path: Path | null): Project {
  return changePerson(project, who, (person) => (person.path === path ? person : { ...person, path }));
}

/** A line drawn by hand, as points; what it has of speed stays. */
export function drawPath(project: Project, who: number, line: readonly Ground[]): Project {
  const points = simplified(line).map(({ x, z }) => pathPoint(x, z));
  if (points.length < 2) return project;
  return setPath(project, who, { points, speed: project.people[who]?.path?.speed ?? null });
}

/** One more point at the end; the first one makes a path that begins at `start`. */
export function addPoint(project: Project, who: number, at: Ground, start: Ground): Project {
  const path = project.people[who]?.path ?? { points: [pathPoint(start.x, start.z)], speed: null };
  return setPath(project, who, { ...path, points: [...path.points, pathPoint(at.x, at.z)] });
}

export function changePoint(project: Project, who: number, index: number, part: Partial<PathPoint>): Project {
  const path = project.people[who]?.path;
  if (!path?.points[index]) return project;
  const points = path.points.map((one, n) => (n === index ? { ...one, ...part } : one));
  return setPath(project, who, { ...path, points });
}

export function removePoint(project: Project, who: number, index: number): Project {
  const path = project.people[who]?.path;
  if (!path?.points[index]) return project;
  const points = path.points.filter((_, n) => n !== index);
  return setPath(project, who, points.length < 2 ? null : { ...path, points });
}

export function setSpeed(project: Project, who: number, speed: number | null): Project {
  const path = project.people[who]?.path;
  return path ? setPath(project, who, { ...path, speed }) : project;
}

/** Ask for a joint at a time: its target there moves, or a new one with this name appears. */
export function putTarget(
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

/** Ask for a whole pose at a time; one that is there at that frame is replaced. */
export function putPose(
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

export function changePose(project: Project, who: number, id: string, part: Partial<Pose>): Project {
  return changePerson(project, who, (person) => ({
    ...person,
    poses: person.poses.map((one) => (one.id === id ? { ...one, ...part } : one)),
  }));
}

export function removePose(project: Project, who: number, id: string): Project {
  return changePerson(project, who, (person) => ({ ...person, poses: person.poses.filter((one) => one.id !== id) }));
}

/** A pose put where somebody stands and faces: `pose` with its pelvis over `at`. */
export function movedTo(positions: readonly Vec3[], at: Ground): Vec3[] {
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
