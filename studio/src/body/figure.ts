/** Small figures of a motion, drawn on a flat canvas: pictures of a block, of a take, of a project. */

import { type MotionClip, POSE, facingAt, poseAt } from "./clip";
import { HEAD, LEFT, PARENTS, PELVIS, RIGHT } from "./skeleton";

/** Metres that a picture is high, and those of them below the floor. */
const HEIGHT = 2.05;
const BELOW = 0.08;
/** Degrees that the figures are turned from the front, so that steps and swings are seen. */
const TURNED = 52;
const LEFT_SIDE = new Set<number>(Object.values(LEFT));
const RIGHT_SIDE = new Set<number>(Object.values(RIGHT));

/** Colours of the middle and the side that is nearer, and of the side that is behind. */
export interface Ink {
  readonly near: string;
  readonly far: string;
}

/** Draw one pose; `x` is where the pelvis is, `floor` where the floor is, in pixels of which `height` are a picture. */
export function figure(
  context: CanvasRenderingContext2D,
  pose: ArrayLike<number>,
  yaw: number,
  at: { readonly x: number; readonly floor: number; readonly height: number },
  ink: Ink,
): void {
  const scale = at.height / HEIGHT;
  const [cos, sin] = [Math.cos(yaw) * scale, Math.sin(yaw) * scale];
  const [px, pz] = [pose[PELVIS * 3]!, pose[PELVIS * 3 + 2]!];
  const place = (joint: number): [number, number] => {
    const [x, z] = [pose[joint * 3]! - px, pose[joint * 3 + 2]! - pz];
    return [at.x + x * cos - z * sin, at.floor - (pose[joint * 3 + 1]! + BELOW) * scale];
  };
  context.lineCap = context.lineJoin = "round";
  context.lineWidth = Math.max(at.height / 24, 1.2);
  const bones = (color: string, isPart: (joint: number) => boolean) => {
    context.strokeStyle = color;
    context.beginPath();
    PARENTS.forEach((parent, joint) => {
      if (parent < 0 || joint === HEAD || !isPart(joint)) return;
      context.moveTo(...place(parent));
      context.lineTo(...place(joint));
    });
    context.stroke();
  };
  bones(ink.far, (joint) => LEFT_SIDE.has(joint));
  bones(ink.near, (joint) => !LEFT_SIDE.has(joint) && !RIGHT_SIDE.has(joint));
  bones(ink.near, (joint) => RIGHT_SIDE.has(joint));
  context.fillStyle = ink.near;
  context.beginPath();
  const [x, y] = place(HEAD);
  context.arc(x, y - 0.07 * scale, 0.11 * scale, 0, Math.PI * 2);
  context.fill();
}

/** Radians that a motion is turned by in its pictures: all of its poses alike, so that turns are seen. */
export function yawOf(clip: MotionClip, person = 0): number {
  return ((facingAt(clip, person, 0) + TURNED) * Math.PI) / 180;
}

/** Draw a motion as a row of so many poses of everybody in it. */
export function strip(canvas: HTMLCanvasElement, clip: MotionClip, count: number, inks: readonly Ink[]): void {
  const [width, height] = [canvas.clientWidth || canvas.width, canvas.clientHeight || canvas.height];
  const ratio = Math.min(devicePixelRatio, 2);
  [canvas.width, canvas.height] = [Math.round(width * ratio), Math.round(height * ratio)];
  const context = canvas.getContext("2d")!;
  context.scale(ratio, ratio);
  const pose = new Float32Array(POSE);
  for (let number = 0; number < count; number += 1) {
    clip.people.forEach((_, person) => {
      const time = ((number + 0.5) / count) * clip.seconds;
      const x = ((number + 0.5) / count) * width + (person - (clip.people.length - 1) / 2) * height * 0.3;
      poseAt(clip, person, time, pose);
      figure(context, pose, yawOf(clip, person), { x, floor: height, height }, inks[person % inks.length]!);
    });
  }
}

/** The colours of the page for the first and the second person. */
export function inks(): Ink[] {
  const style = getComputedStyle(document.documentElement);
  const ink = (name: string): Ink => ({
    near: style.getPropertyValue(`--${name}`).trim(),
    far: style.getPropertyValue(`--${name}-far`).trim(),
  });
  return [ink("figure"), ink("figure-second")];
}
