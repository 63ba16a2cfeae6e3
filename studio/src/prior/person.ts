/** The uniform person: bones, limbs, and forward kinematics (`motionloom.core.skeleton.SMPL22`). */

import { COUNT, HEAD, LEFT, NECK, PARENTS, PELVIS, RIGHT, SPINE1, SPINE2, SPINE3 } from "../body/skeleton";
import { type Turn, type Vec, add, norm, rotate, scaled, times, unit } from "./turns";

/** Metres of the bones by child joint 1 to 21, and their directions in a T-pose. */
const BONES: readonly (readonly [number, number, number, number])[] = [
  [0.1031, 0.62, -0.78, 0],
  [0.1099, -0.62, -0.78, 0],
  [0.1316, 0, 1, -0.15],
  [0.3936, 0, -1, 0],
  [0.3902, 0, -1, 0],
  [0.1432, 0, 1, 0],
  [0.4324, 0, -1, -0.06],
  [0.4256, 0, -1, -0.06],
  [0.0574, 0, 1, 0.05],
  [0.1434, 0.1, -0.42, 0.9],
  [0.1494, -0.1, -0.42, 0.9],
  [0.2194, 0, 1, -0.12],
  [0.1375, 0.55, 0.83, -0.08],
  [0.1434, -0.55, 0.83, -0.08],
  [0.103, 0, 0.86, 0.5],
  [0.1316, 1, 0.25, -0.1],
  [0.123, -1, 0.25, -0.1],
  [0.2568, 1, 0, 0],
  [0.2631, -1, 0, 0],
  [0.266, 1, 0, 0],
  [0.2699, -1, 0, 0],
];

/** Each joint in its parent's frame, metres; the toes stand on the floor at rest. */
export const REST: readonly Vec[] = restOf();
export const LENGTHS: readonly number[] = REST.map((bone, joint) => (joint ? norm(bone) : 0));

function restOf(): Vec[] {
  const bones = BONES.map(([length, x, y, z]) => scaled(unit([x, y, z]), length));
  const leg = [LEFT.hip, LEFT.knee, LEFT.ankle, LEFT.foot].reduce((sum, joint) => sum - bones[joint - 1]![1], 0);
  return [[0, leg, 0], ...bones];
}

/** Two bones and a hinge, hanging on the frame of joint `base`; `tip` are the toes of a leg. */
export interface Limb {
  readonly base: number;
  readonly start: number;
  readonly middle: number;
  readonly end: number;
  readonly hinge: Vec;
  readonly tip: number | null;
}

const leg = ({ hip, knee, ankle, foot }: typeof LEFT): Limb => {
  return { base: PELVIS, start: hip, middle: knee, end: ankle, hinge: [1, 0, 0], tip: foot };
};
const arm = ({ shoulder, elbow, wrist }: typeof LEFT, y: number): Limb => {
  return { base: SPINE3, start: shoulder, middle: elbow, end: wrist, hinge: [0, y, 0], tip: null };
};

/** Left leg, right leg, left arm, right arm. */
export const LIMBS: readonly Limb[] = [leg(LEFT), leg(RIGHT), arm(LEFT, -1), arm(RIGHT, 1)];
export const TRUNK = [SPINE1, SPINE2, SPINE3, NECK, LEFT.collar, RIGHT.collar, LEFT.hip, RIGHT.hip] as const;
export { COUNT, HEAD, LEFT, NECK, PARENTS, PELVIS, RIGHT, SPINE1, SPINE2, SPINE3 };

/** A person moving: the root's place, and each joint's turn in its parent's frame. */
export interface Body {
  readonly fps: number;
  readonly root: Vec[];
  readonly turns: Turn[][];
}

/** Turns of all joints in the world in one frame. */
export function worldOf(turns: readonly Turn[]): Turn[] {
  const world: Turn[] = [];
  PARENTS.forEach((parent, joint) => {
    world.push(parent < 0 ? turns[joint]! : times(world[parent]!, turns[joint]!));
  });
  return world;
}

/** Places of all joints in the world, frame by frame. */
export function placesOf(body: Body): Vec[][] {
  return body.turns.map((turns, frame) => {
    const world = worldOf(turns);
    const places: Vec[] = [];
    PARENTS.forEach((parent, joint) => {
      places.push(parent < 0 ? body.root[frame]! : add(places[parent]!, rotate(world[parent]!, REST[joint]!)));
    });
    return places;
  });
}
