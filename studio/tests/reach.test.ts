import { describe, expect, it } from "vitest";
import { motionClip, poseAt, vec } from "../src/body/clip";
import { reach } from "../src/body/reach";
import { LEFT_SHOULDER, PARENTS, RIGHT_ELBOW, RIGHT_SHOULDER, RIGHT_WRIST } from "../src/body/skeleton";
import { distance } from "../src/project/path";
import type { Vec3 } from "../src/project/model";

/** Joints on a slope, so that every bone has a length and a direction of its own. */
const pose = Float32Array.from({ length: 66 }, (_, n) => Math.sin(n * 1.7) * 0.2 + Math.floor(n / 3) * 0.05);
const bones = (one: Float32Array) =>
  PARENTS.map((parent, joint) => (parent < 0 ? 0 : distance(vec(one, parent), vec(one, joint))));

describe("reaching", () => {
  const shoulder = vec(pose, RIGHT_SHOULDER);
  const arm = bones(pose)[RIGHT_WRIST]! + bones(pose)[RIGHT_ELBOW]!;
  const near: Vec3 = [shoulder[0] + arm * 0.7, shoulder[1], shoulder[2]];

  it("puts the hand on the target, keeps the bones' lengths and leaves the other arm alone", () => {
    const { pose: found, moved } = reach(pose, RIGHT_WRIST, near);
    expect(distance(vec(found, RIGHT_WRIST), near)).toBeLessThan(1e-3);
    expect(moved).toBe(0);
    bones(found).forEach((size, joint) => expect(size).toBeCloseTo(bones(pose)[joint]!, 3));
    expect(vec(found, LEFT_SHOULDER)).toEqual(vec(pose, LEFT_SHOULDER));
  });

  it("moves the body as far as the arm is too short", () => {
    const far: Vec3 = [shoulder[0] + arm + 0.5, shoulder[1], shoulder[2]];
    const { pose: found, moved } = reach(pose, RIGHT_WRIST, far);
    expect(moved).toBeCloseTo(0.5, 2);
    expect(distance(vec(found, RIGHT_WRIST), far)).toBeLessThan(0.01);
  });
});

describe("a clip", () => {
  it("is mixed between frames and stays at its ends", () => {
    const clip = motionClip(20, [Float32Array.from({ length: 132 }, (_, n) => (n < 66 ? 0 : 1))]);
    const out = new Float32Array(66);
    expect(poseAt(clip, 0, 0.025, out)[0]).toBeCloseTo(0.5);
    expect(poseAt(clip, 0, -1, out)[0]).toBe(0);
    expect(poseAt(clip, 0, 9, out)[0]).toBe(1);
  });
});
