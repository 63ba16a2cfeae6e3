/** A motion as a VRM animation (VRMC_vrm_animation 1.0), for any VRM avatar; bones of the uniform person. */

import { JOINTS, PARENTS } from "../body/skeleton";
import { type Body, REST } from "../prior/person";
import { type Content, Packing } from "./glbFile";

/** VRM's names of the 22 joints. */
const BONES: Readonly<Record<string, string>> = {
  pelvis: "hips",
  spine1: "spine",
  spine2: "chest",
  spine3: "upperChest",
  neck: "neck",
  head: "head",
  hip: "UpperLeg",
  knee: "LowerLeg",
  ankle: "Foot",
  foot: "Toes",
  collar: "Shoulder",
  shoulder: "UpperArm",
  elbow: "LowerArm",
  wrist: "Hand",
};

export function vrma(body: Body, name: string): ArrayBuffer {
  const humanBones = Object.fromEntries(
    JOINTS.map((joint, node) => {
      const [, side, part] = /^(left|right)_(.*)$/.exec(joint) ?? [];
      return [side ? side + BONES[part!]! : BONES[joint]!, { node }];
    }),
  );
  const content: Content = {
    asset: { version: "2.0" },
    scene: 0,
    scenes: [{ nodes: [0] }],
    nodes: JOINTS.map((joint, n) => {
      const children = JOINTS.flatMap((_, k) => (PARENTS[k] === n ? [k] : []));
      return { name: joint, translation: [...REST[n]!], ...(children.length ? { children } : {}) };
    }),
    extensionsUsed: ["VRMC_vrm_animation"],
    extensions: { VRMC_vrm_animation: { specVersion: "1.0", humanoid: { humanBones } } },
  };
  const packing = new Packing(content, new Uint8Array());
  packing.animate(name, {
    fps: body.fps,
    turns: new Map(JOINTS.map((_, joint) => [joint, body.turns.map((frame) => frame[joint]!)])),
    places: new Map([[0, body.root]]),
  });
  return packing.bytes();
}
