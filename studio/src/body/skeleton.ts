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
export const LEFT_HIP = at("left_hip");
export const RIGHT_HIP = at("right_hip");
export const SPINE1 = at("spine1");
export const SPINE2 = at("spine2");
export const SPINE3 = at("spine3");
export const NECK = at("neck");
export const HEAD = at("head");
export const LEFT_COLLAR = at("left_collar");
export const RIGHT_COLLAR = at("right_collar");
export const LEFT_SHOULDER = at("left_shoulder");
export const RIGHT_SHOULDER = at("right_shoulder");
export const LEFT_ELBOW = at("left_elbow");
export const RIGHT_ELBOW = at("right_elbow");
export const LEFT_WRIST = at("left_wrist");
export const RIGHT_WRIST = at("right_wrist");
export const LEFT_KNEE = at("left_knee");
export const RIGHT_KNEE = at("right_knee");
export const LEFT_ANKLE = at("left_ankle");
export const RIGHT_ANKLE = at("right_ankle");
export const LEFT_FOOT = at("left_foot");
export const RIGHT_FOOT = at("right_foot");

/** Joints that one drags, in the order that the keyboard goes through them. */
export const TARGETS = [
  RIGHT_WRIST,
  LEFT_WRIST,
  RIGHT_ANKLE,
  LEFT_ANKLE,
  HEAD,
  PELVIS,
  RIGHT_ELBOW,
  LEFT_ELBOW,
  RIGHT_KNEE,
  LEFT_KNEE,
  RIGHT_FOOT,
  LEFT_FOOT,
  RIGHT_SHOULDER,
  LEFT_SHOULDER,
] as const;

/** "left_wrist" as somebody reads it. */
export function jointName(joint: number): string {
  return (JOINTS[joint] ?? "joint").replace("_", " ");
}
