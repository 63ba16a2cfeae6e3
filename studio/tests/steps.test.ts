import { Texture } from "three";
import { describe, expect, it } from "vitest";
import { motionClip } from "../src/body/clip";
import { COUNT, SIDES } from "../src/body/skeleton";
import { cover } from "../src/stage/backdrop";
import { stepsOf } from "../src/stage/steps";

const FPS = 20;

/** Somebody who takes a step ahead, and one up of so many metres, with every foot. */
function climb(up: number, treads = 6) {
  const frames = treads * FPS;
  const data = new Float32Array(frames * COUNT * 3);
  for (let frame = 0; frame < frames; frame += 1) {
    const at = frame / FPS;
    for (let joint = 0; joint < COUNT; joint += 1) data.set([0, 1 + at * up, at * 0.3], (frame * COUNT + joint) * 3);
    SIDES.forEach(({ ankle, foot }, side) => {
      // Each foot bears for two seconds less a fifth, in which it goes on to the tread after the next.
      const begun = Math.floor((at + side) / 2) * 2 - side;
      const moved = Math.max(0, (at - begun - 1.8) / 0.2);
      const tread = Math.max(begun, 0) + moved * 2;
      data.set([side ? -0.1 : 0.1, tread * up + 0.07, tread * 0.3], (frame * COUNT + ankle) * 3);
      data.set([side ? -0.1 : 0.1, tread * up, tread * 0.3 + 0.12], (frame * COUNT + foot) * 3);
    });
  }
  return motionClip(FPS, [data]);
}

describe("steps", () => {
  it("are under who goes up, one for each tread, as high as the feet", () => {
    const steps = stepsOf(climb(0.18));
    expect(steps.length).toBeGreaterThanOrEqual(4);
    steps.forEach(({ height, z, yaw, deep }, n) => {
      expect(height).toBeCloseTo((n + 1) * 0.18, 1);
      expect(z).toBeCloseTo((n + 1) * 0.3 + 0.06, 1);
      expect(yaw).toBeCloseTo(0, 5);
      // The last ones are trodden on when the motion ends.
      if (n < 3) expect(deep).toBeCloseTo(0.3, 1);
    });
  });

  it("are not under who stays on the floor", () => {
    expect(stepsOf(climb(0))).toEqual([]);
  });
});

describe("a backdrop", () => {
  it("fills the frame and keeps its form", () => {
    const texture = new Texture({ width: 400, height: 100 } as never);
    cover(texture, 2);
    expect(texture.repeat.toArray()).toEqual([0.5, 1]);
    expect(texture.offset.toArray()).toEqual([0.25, 0]);
    cover(texture, 8);
    expect(texture.repeat.toArray()).toEqual([1, 0.5]);
  });
});
