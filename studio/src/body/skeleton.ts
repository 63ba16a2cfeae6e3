/** The 22 joints of the uniform person, in the order that the server speaks. */

export const JOINTS = [
  "pelvis",
  "left_hip",
  "right_hip",
  "spine1",
  "left_knee",
  "right_knee",
  "spine2",
  "left_ankle",
  "right_ankle",
  "spine3",
  "left_foot",
  "right_foot",
  "neck",
  "left_collar",
  "right_collar",
  "head",
  "left_shoulder",
  "right_shoulder",
  "left_elbow",
  "right_elbow",
  "left_wrist",
  "right_wrist",
] as const;

export const PARENTS = [-1, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 9, 9, 12, 13, 14, 16, 17, 18, 19] as const;

export const COUNT = JOINTS.length;

const at = (name: (typeof JOINTS)[number]) => JOINTS.indexOf(name);

export const PELVIS = at("pelvis");
export const SPINE1 = at("spine1");
export const SPINE2 = at("spine2");
export const SPINE3 = at("spine3");
export const NECK = at("neck");
export const HEAD = at("head");
/** The joints of a leg and an arm, outwards. */
export interface Side {
  readonly hip: number;
  readonly knee: number;
  readonly ankle: number;
  readonly foot: number;
  readonly collar: number;
  readonly shoulder: number;
  readonly elbow: number;
  readonly wrist: number;
}

function side(name: "left" | "right"): Side {
  return {
    hip: at(`${name}_hip`),
    knee: at(`${name}_knee`),
    ankle: at(`${name}_ankle`),
    foot: at(`${name}_foot`),
    collar: at(`${name}_collar`),
    shoulder: at(`${name}_shoulder`),
    elbow: at(`${name}_elbow`),
    wrist: at(`${name}_wrist`),
  };
}

export const LEFT = side("left");
export const RIGHT = side("right");
export const SIDES = [LEFT, RIGHT] as const;

/** Joints that one drags, in the order that the keyboard goes through them. */
export const TARGETS = [
  RIGHT.wrist,
  LEFT.wrist,
  RIGHT.ankle,
  LEFT.ankle,
  HEAD,
  PELVIS,
  RIGHT.elbow,
  LEFT.elbow,
  RIGHT.knee,
  LEFT.knee,
  RIGHT.foot,
  LEFT.foot,
  RIGHT.shoulder,
  LEFT.shoulder,
] as const;

/** "left_wrist" as somebody reads it. */
export function jointName(joint: number): string {
  return (JOINTS[joint] ?? "joint").replace("_", " ");
}
