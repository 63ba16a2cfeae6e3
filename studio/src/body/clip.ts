/** A motion in the page: places of 22 joints for each person and frame. */

import type { Vec3 } from "../project/model";
import { COUNT, LEFT, RIGHT } from "./skeleton";

/** Numbers of one pose. */
export const POSE = COUNT * 3;

export interface MotionClip {
  readonly fps: number;
  readonly frames: number;
  readonly seconds: number;
  /** For each person (frames * 22 * 3) metres. */
  readonly people: readonly Float32Array[];
  /** For each person (frames * 3): the direction in which the head looks, of length 1; 0 where it is not known. */
  readonly looks?: readonly Float32Array[];
}

export function motionClip(fps: number, people: readonly Float32Array[], looks?: readonly Float32Array[]): MotionClip {
  const frames = Math.floor((people[0]?.length ?? 0) / POSE);
  return { fps, frames, seconds: frames / fps, people, looks };
}

/** A clip of which one person does, from second `begin` on, what another clip holds; no longer than it was. */
export function overlaid(clip: MotionClip, part: MotionClip, person: number, begin: number): MotionClip {
  const people = clip.people.map((one) => one.slice());
  const looks = clip.looks?.map((one) => one.slice());
  const data = people[person];
  const first = Math.ceil(begin * clip.fps - 1e-6);
  const last = Math.min(clip.frames - 1, Math.floor((begin + part.seconds - 1 / part.fps) * clip.fps + 1e-6));
  for (let frame = first; data && frame <= last; frame += 1)
    poseAt(part, 0, frame / clip.fps - begin, data.subarray(frame * POSE, (frame + 1) * POSE));
  looks?.[person]?.fill(0, first * 3, (last + 1) * 3);
  return { ...clip, people, looks };
}

/** Write the pose at a time into `out`; between frames it is mixed, beyond the ends it is the first or last one. */
export function poseAt(clip: MotionClip, person: number, time: number, out: Float32Array): Float32Array {
  return mixed(clip, clip.people[Math.min(person, clip.people.length - 1)]!, time, POSE, out);
}

/** Write the direction in which a head looks at a time into `out`, of length 1 or a little less; null: not known. */
export function lookAt(clip: MotionClip, person: number, time: number, out: Float32Array): Float32Array | null {
  const data = clip.looks?.[Math.min(person, clip.looks.length - 1)];
  return data && Math.hypot(...mixed(clip, data, time, 3, out)) > 0.5 ? out : null;
}

function mixed(clip: MotionClip, data: Float32Array, time: number, width: number, out: Float32Array): Float32Array {
  const at = Math.min(Math.max(time * clip.fps, 0), clip.frames - 1);
  const [first, part] = [Math.floor(at), at % 1];
  const [a, b] = [first * width, Math.min(first + 1, clip.frames - 1) * width];
  for (let n = 0; n < width; n += 1) out[n] = data[a + n]! + (data[b + n]! - data[a + n]!) * part;
  return out;
}

/** Where a joint is at the frame nearest to a time. */
export function jointAt(clip: MotionClip, person: number, joint: number, time: number): Vec3 {
  const data = clip.people[Math.min(person, clip.people.length - 1)]!;
  const frame = Math.min(Math.max(Math.round(time * clip.fps), 0), clip.frames - 1);
  const at = frame * POSE + joint * 3;
  return [data[at]!, data[at + 1]!, data[at + 2]!];
}

export function vec(pose: ArrayLike<number>, joint: number): Vec3 {
  return [pose[joint * 3]!, pose[joint * 3 + 1]!, pose[joint * 3 + 2]!];
}

/** The 22 places of a pose as they stand in a project. */
export function places(pose: ArrayLike<number>): Vec3[] {
  return Array.from({ length: COUNT }, (_, joint) => {
    const [x, y, z] = vec(pose, joint);
    return [Math.round(x * 1000) / 1000, Math.round(y * 1000) / 1000, Math.round(z * 1000) / 1000] as const;
  });
}

/** Degrees that somebody faces at a time, by the hips; 0 is +Z and 90 is +X. */
export function facingAt(clip: MotionClip, person: number, time: number): number {
  const [left, right] = [jointAt(clip, person, LEFT.hip, time), jointAt(clip, person, RIGHT.hip, time)];
  return (Math.atan2(right[2] - left[2], left[0] - right[0]) * 180) / Math.PI;
}
