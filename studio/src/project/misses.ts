/** How far a motion is from what was asked, in centimetres. */

import { type MotionClip, jointAt } from "../body/clip";
import { LEFT, RIGHT } from "../body/skeleton";
import { type Person, type Pose, type Target, length, type Project } from "./model";
import { distance, placeAt, timed } from "./path";

/** Beyond this a target counts as not met. */
export const UNMET = 5;

/** Nobody's feet leave the floor by more, not even in a jump. */
export const FLYING = 45;

const FEET = [LEFT.ankle, RIGHT.ankle];

/** Farthest from the target in its time, centimetres. */
export function targetMiss(clip: MotionClip, person: number, target: Target): number {
  const until = target.until ?? target.time;
  let worst = 0;
  for (let time = target.time; time <= until + 1e-6; time += 1 / clip.fps) {
    worst = Math.max(worst, distance(jointAt(clip, person, target.joint, time), target.position));
  }
  return worst * 100;
}

/** How far the body had to leave the floor for a target, centimetres: both feet above where they stand otherwise. */
export function targetLift(clip: MotionClip, person: number, target: Target): number {
  const height = (time: number) => Math.min(...FEET.map((joint) => jointAt(clip, person, joint, time)[1]));
  const heights = Array.from({ length: clip.frames }, (_, frame) => height(frame / clip.fps)).sort((a, b) => a - b);
  const standing = heights[Math.floor(heights.length / 10)] ?? 0;
  return Math.max(height(target.time) - standing, 0) * 100;
}

/** Whether a target was missed, or met by somebody who flies. */
export function isUnmet(clip: MotionClip, person: number, target: Target): boolean {
  return targetMiss(clip, person, target) > UNMET || targetLift(clip, person, target) > FLYING;
}

/** Mean over the joints, centimetres. */
export function poseMiss(clip: MotionClip, person: number, pose: Pose): number {
  const sum = pose.positions.reduce(
    (all, position, joint) => all + distance(jointAt(clip, person, joint, pose.time), position),
    0,
  );
  return (sum / pose.positions.length) * 100;
}

/** Mean and farthest distance of the pelvis from where the path is at that time, centimetres; null without a path. */
export function pathMiss(clip: MotionClip, person: number, asked: Person, seconds: number): [number, number] | null {
  const path = asked.path && timed(asked.path, seconds);
  if (!path) return null;
  let [sum, count, worst] = [0, 0, 0];
  for (let time = 0; time <= path.times.at(-1)! + 1e-6; time += 1 / clip.fps) {
    const place = placeAt(path, time);
    const pelvis = jointAt(clip, person, 0, time);
    const apart = Math.hypot(pelvis[0] - place.x, pelvis[2] - place.z);
    sum += apart;
    count += 1;
    worst = Math.max(worst, apart);
  }
  return [(sum / count) * 100, worst * 100];
}

/** Whether what is asked has been drawn: errors of another motion would say nothing. */
export function isMeasurable(project: Project, clip: MotionClip | null): clip is MotionClip {
  return clip !== null && Math.abs(clip.seconds - length(project)) < 0.11;
}
