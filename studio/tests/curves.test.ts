import { describe, expect, it } from "vitest";
import { POSE, motionClip } from "../src/body/clip";
import { courseOf } from "../src/timeline/curves";

describe("the course of a joint", () => {
  it("is its height and its speed at every frame", () => {
    const frames = 21;
    const places = Float32Array.from({ length: frames * POSE }, (_, n) => {
      const [frame, axis] = [Math.floor(n / POSE), n % 3];
      return axis === 0 ? frame * 0.03 : axis === 1 ? 1 + frame * 0.04 : 2;
    });
    const { height, speed } = courseOf(motionClip(20, [places]), 0, 21);
    expect(height).toHaveLength(frames);
    expect(height[10]).toBeCloseTo(1.4);
    speed.forEach((one) => expect(one).toBeCloseTo(1, 4));
    expect(courseOf(motionClip(20, [places.slice(0, POSE)]), 0, 0).speed).toEqual([0]);
  });
});
