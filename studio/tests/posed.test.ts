import { describe, expect, it } from "vitest";
import { between, mirrored, moved, turnedTo } from "../src/body/posed";
import { LEFT, PARENTS, PELVIS, RIGHT } from "../src/body/skeleton";
import { fillPoses, setPose } from "../src/project/constraints";
import { type Vec3, exampleProject } from "../src/project/model";

/** Somebody in a step of a walk. */
const REST: readonly Vec3[] = [
  [0.05, 0.927, 1.465],
  [0.109, 0.842, 1.462],
  [-0.024, 0.846, 1.468],
  [0.058, 1.057, 1.445],
  [0.125, 0.506, 1.665],
  [0.01, 0.466, 1.551],
  [0.056, 1.2, 1.444],
  [0.11, 0.16, 1.406],
  [0.015, 0.076, 1.381],
  [0.054, 1.258, 1.443],
  [0.107, 0.045, 1.491],
  [0.031, 0.003, 1.511],
  [0.045, 1.473, 1.4],
  [0.125, 1.372, 1.416],
  [-0.029, 1.374, 1.43],
  [0.045, 1.576, 1.398],
  [0.246, 1.417, 1.391],
  [-0.146, 1.412, 1.429],
  [0.255, 1.163, 1.352],
  [-0.157, 1.149, 1.429],
  [0.279, 0.916, 1.448],
  [-0.186, 0.915, 1.56],
];
const raised = moved(REST, [RIGHT.wrist], [0.1, 0.5, 0.1], []);
const apart = (a: Vec3, b: Vec3) => Math.hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
const bones = (pose: readonly Vec3[]) =>
  PARENTS.flatMap((parent, joint) => (parent < 0 ? [] : [apart(pose[joint]!, pose[parent]!)]));

function close(a: readonly number[], b: readonly number[], within = 0.005): void {
  a.forEach((one, index) => expect(Math.abs(one - b[index]!)).toBeLessThan(within));
}

describe("a pose", () => {
  it("has several joints moved together, while others stay", () => {
    const hands = moved(REST, [LEFT.wrist, RIGHT.wrist], [0, 0.3, 0.1], []);
    close(hands[LEFT.wrist]!, [REST[LEFT.wrist]![0], REST[LEFT.wrist]![1] + 0.3, REST[LEFT.wrist]![2] + 0.1]);
    close(hands[LEFT.ankle]!, REST[LEFT.ankle]!);
    const squat = moved(REST, [PELVIS], [0, -0.2, 0], [LEFT.ankle, RIGHT.ankle]);
    close(squat[PELVIS]!, [REST[PELVIS]![0], REST[PELVIS]![1] - 0.2, REST[PELVIS]![2]]);
    close([...squat[LEFT.ankle]!, ...squat[RIGHT.ankle]!], [...REST[LEFT.ankle]!, ...REST[RIGHT.ankle]!]);
    close(bones(squat), bones(REST));
    const far = moved(REST, [RIGHT.wrist], [0, 9, 0], []);
    close(far[PELVIS]!, REST[PELVIS]!);
    close(bones(far), bones(REST));
  });

  it("is mirrored where it is, and is itself after two times", () => {
    const other = mirrored(raised);
    expect(other[LEFT.wrist]![1]).toBeCloseTo(raised[RIGHT.wrist]![1], 3);
    close(other[PELVIS]!, raised[PELVIS]!);
    mirrored(other).forEach((place, joint) => close(place, raised[joint]!));
  });

  it("comes to another place and turn whole", () => {
    const there = turnedTo(raised, [3, -1], 90);
    close(bones(there), bones(raised));
    close([there[PELVIS]![0], there[PELVIS]![2]], [3, -1]);
    const [left, right] = [there[LEFT.hip]!, there[RIGHT.hip]!];
    expect((Math.atan2(right[2] - left[2], left[0] - right[0]) * 180) / Math.PI).toBeCloseTo(90, 0);
  });

  it("has others evenly between it and the next, with bones as long", () => {
    const [half] = between(REST, raised, 1);
    close(bones(half!), bones(REST));
    const keyed = setPose(setPose(exampleProject(), 0, "a", 1, REST), 0, "b", 3, raised);
    const { poses } = fillPoses(keyed, 0, keyed.people[0]!.poses[0]!.id, 3).people[0]!;
    expect(poses.map((one) => one.time).sort()).toEqual([1, 1.5, 2, 2.5, 3]);
    close(poses.find((one) => one.time === 2)!.positions.flat(), half!.flat());
    expect(fillPoses(keyed, 0, keyed.people[0]!.poses[1]!.id, 3)).toBe(keyed);
  });
});
