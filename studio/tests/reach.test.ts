import { describe, expect, it } from "vitest";
import { type MotionClip, jointAt, lookAt, motionClip, poseAt, vec } from "../src/body/clip";
import { reach } from "../src/body/reach";
import { LEFT, PARENTS, RIGHT } from "../src/body/skeleton";
import { isUnmet, targetLift, targetMiss } from "../src/project/misses";
import { distance } from "../src/project/path";
import type { Target, Vec3 } from "../src/project/model";

/** Joints on a slope, so that every bone has a length and a direction of its own. */
const pose = Float32Array.from({ length: 66 }, (_, n) => Math.sin(n * 1.7) * 0.2 + Math.floor(n / 3) * 0.05);
const bones = (one: Float32Array) =>
  PARENTS.map((parent, joint) => (parent < 0 ? 0 : distance(vec(one, parent), vec(one, joint))));

describe("reaching", () => {
  const shoulder = vec(pose, RIGHT.shoulder);
  const arm = bones(pose)[RIGHT.wrist]! + bones(pose)[RIGHT.elbow]!;
  const near: Vec3 = [shoulder[0] + arm * 0.7, shoulder[1], shoulder[2]];

  it("puts the hand on the target, keeps the bones' lengths and leaves the other arm alone", () => {
    const { pose: found, moved } = reach(pose, RIGHT.wrist, near);
    expect(distance(vec(found, RIGHT.wrist), near)).toBeLessThan(1e-3);
    expect(moved).toBe(0);
    bones(found).forEach((size, joint) => expect(size).toBeCloseTo(bones(pose)[joint]!, 3));
    expect(vec(found, LEFT.shoulder)).toEqual(vec(pose, LEFT.shoulder));
  });

  it("moves the body as far as the arm is too short", () => {
    const far: Vec3 = [shoulder[0] + arm + 0.5, shoulder[1], shoulder[2]];
    const { pose: found, moved } = reach(pose, RIGHT.wrist, far);
    expect(moved).toBeCloseTo(0.5, 2);
    expect(distance(vec(found, RIGHT.wrist), far)).toBeLessThan(0.01);
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

  it("says where the head looks, between frames as well, where that is known", () => {
    const people = [new Float32Array(3 * 66)];
    const clip = motionClip(20, people, [Float32Array.of(0, 0, 1, 1, 0, 0, 0, 0, 0)]);
    const out = new Float32Array(3);
    expect([...lookAt(clip, 0, 0.025, out)!]).toEqual([0.5, 0, 0.5]);
    expect(lookAt(clip, 0, 0.1, out)).toBeNull();
    expect(lookAt(motionClip(20, people), 0, 0, out)).toBeNull();
  });
});

describe("a target that is met", () => {
  const frames = 40;
  const flown = (metres: number) =>
    motionClip(20, [
      Float32Array.from({ length: frames * 66 }, (_, n) => {
        const up = Math.floor(n / 66) === 20 ? metres : 0;
        return n % 3 === 1 ? ((n % 66) / 66) * 1.6 + up : 0;
      }),
    ]);
  const target = (clip: MotionClip): Target => {
    const position = jointAt(clip, 0, RIGHT.wrist, 1);
    return { id: "a", joint: RIGHT.wrist, time: 1, until: null, position };
  };

  it("by jumping is met, and by flying is not", () => {
    const [jump, flight] = [flown(0.3), flown(0.9)];
    expect(targetLift(jump, 0, target(jump))).toBeCloseTo(30, 3);
    expect(isUnmet(jump, 0, target(jump))).toBe(false);
    expect(targetMiss(flight, 0, target(flight))).toBeCloseTo(0, 5);
    expect(isUnmet(flight, 0, target(flight))).toBe(true);
  });
});
