/** Own characters: bones by name, and the person's motion on bones that rest otherwise. */

import { describe, expect, test } from "vitest";
import { JOINTS, LEFT, PARENTS, RIGHT } from "../src/body/skeleton";
import { type Body, LENGTHS, REST, placesOf } from "../src/prior/person";
import { type Turn, type Vec, aboutAxis, add, minus, norm, rotate, scaled, times, unit } from "../src/prior/turns";
import { type Content, Packing, unpacked, withoutAnimations } from "../src/tab/glbFile";
import { partsByName } from "../src/tab/names";
import { fitOf, retargeted } from "../src/tab/retarget";
import { type Pose, type Rig, WORLD, hung, rigOf } from "../src/tab/rig";
import { vrma } from "../src/tab/vrma";

const FRAMES = 12;

/** Somebody who lifts a leg, raises and bends the arms, and turns while going on. */
function body(): Body {
  const turns = Array.from({ length: FRAMES }, (_, f): Turn[] => {
    const u = f / FRAMES;
    const own: Turn[] = JOINTS.map(() => [1, 0, 0, 0]);
    own[0] = aboutAxis([0, 1, 0], 0.8 * u);
    own[LEFT.hip] = aboutAxis([1, 0, 0], -1.1 * u);
    own[LEFT.knee] = aboutAxis([1, 0, 0], 1.3 * u);
    own[LEFT.shoulder] = aboutAxis(unit([0.3, 0.2, 1]), -1.2 + u);
    own[RIGHT.shoulder] = aboutAxis([0, 0, 1], 1.2);
    own[LEFT.elbow] = aboutAxis([0, -1, 0], 1.4 * u);
    return own;
  });
  return { fps: 20, root: turns.map((_, f): Vec => [0.05 * f, REST[0]![1], 0.1 * f]), turns };
}

/**
 * The person's bones with Mixamo's names, 1.3 times as large, in centimetres under a node that makes metres of them,
 * facing `facing`, its arms hanging by `hanging`, and every bone's own frame turned somehow.
 */
function character({ facing = 0, hanging = 0, names = MIXAMO }): Content {
  const place: Vec[] = [];
  const odd = JOINTS.map((_, j): Turn => aboutAxis(unit([j % 3, 1, (j % 5) - 2]), 0.4 * j));
  REST.forEach((bone, j) => {
    const arm = [LEFT, RIGHT].findIndex(({ elbow, wrist }) => j === elbow || j === wrist);
    const hung = arm < 0 ? bone : rotate(aboutAxis([0, 0, 1], arm ? hanging : -hanging), bone);
    const way = scaled(rotate(aboutAxis([0, 1, 0], facing), hung), 130);
    place[j] = j ? add(place[PARENTS[j]!]!, way) : way;
  });
  const nodes = JOINTS.map((_, j) => {
    const above = j ? odd[PARENTS[j]!]! : ([1, 0, 0, 0] as const);
    const back: Turn = [above[0], -above[1], -above[2], -above[3]];
    const [w, x, y, z] = times(back, odd[j]!);
    const offset = rotate(back, j ? minus(place[j]!, place[PARENTS[j]!]!) : place[j]!);
    const children = JOINTS.flatMap((__, k) => (PARENTS[k] === j ? [k] : []));
    return { name: names[j]!, translation: [...offset], rotation: [x, y, z, w], children };
  });
  return {
    asset: { version: "2.0" },
    nodes: [...nodes, { name: "Armature", scale: [0.01, 0.01, 0.01], children: [0] }],
    skins: [{ joints: JOINTS.map((_, j) => j) }],
  };
}

const MIXAMO = [
  "Hips LeftUpLeg RightUpLeg Spine LeftLeg RightLeg Spine1 LeftFoot RightFoot Spine2 LeftToeBase RightToeBase Neck",
  "LeftShoulder RightShoulder Head LeftArm RightArm LeftForeArm RightForeArm LeftHand RightHand",
]
  .join(" ")
  .split(" ")
  .map((name) => `mixamorig:${name}`);

/** Places of a rig's bones in a frame of moves. */
function placed(rig: Rig, moves: ReturnType<typeof retargeted>, f: number): Vec[] {
  const world: Pose[] = [];
  for (const n of rig.order) {
    const bone = rig.bones[n]!;
    const own = { ...bone, turn: moves.turns.get(n)?.[f] ?? bone.turn, place: moves.places.get(n)?.[f] ?? bone.place };
    world[n] = hung(bone.parent < 0 ? WORLD : world[bone.parent]!, own);
  }
  return world.map(({ place }) => place);
}

describe("a motion on another body", () => {
  test.each([{}, { hanging: 0.9 }, { facing: Math.PI }, { facing: Math.PI / 2, hanging: 0.5 }])("%o", (how) => {
    const person = body();
    const rig = rigOf(character(how), new Map());
    const moves = retargeted(person, fitOf(rig));
    const seen = placesOf(person);
    for (let f = 0; f < FRAMES; f += 1) {
      const found = placed(rig, moves, f);
      JOINTS.forEach((name, j) => {
        expect(norm(minus(found[j]!, scaled(seen[f]![j]!, 1.3))), `${name}, frame ${f}`).toBeLessThan(2e-3);
      });
    }
  });

  test("nothing twists: a hand turns as the forearm does", () => {
    const rig = rigOf(character({ hanging: 0.9 }), new Map());
    const moves = retargeted(body(), fitOf(rig));
    const own = moves.turns.get(LEFT.wrist)!;
    for (const turn of own) expect(Math.abs(turn.reduce((sum, x, k) => sum + x * own[0]![k]!, 0))).toBeCloseTo(1, 6);
  });

  test("bones that were bound otherwise than the file has them go by how they were bound", () => {
    const content = character({});
    const straight = rigOf(content, new Map());
    const bind = new Map(JOINTS.map((_, j) => [j, straight.rest[j]!] as const));
    const bent = structuredClone(content);
    bent.nodes![LEFT.elbow]!.rotation = [0, 0, 0.6, 0.8];
    const rig = rigOf(bent, bind);
    const [found, seen] = [placed(rig, retargeted(body(), fitOf(rig)), 5), placesOf(body())[5]!];
    expect(norm(minus(found[LEFT.wrist]!, scaled(seen[LEFT.wrist]!, 1.3)))).toBeLessThan(2e-3);
  });

  test("who is no humanoid is refused in a sentence", () => {
    const nameless = character({ names: JOINTS.map((_, n) => `thing ${n}`) });
    expect(() => rigOf(nameless, new Map())).toThrow("no left hip, right hip, left knee and 7 more by name");
    expect(() => rigOf({ ...character({}), skins: [] }, new Map())).toThrow("no skeleton moves its mesh");
    const round = character({});
    round.nodes![LEFT.foot]!.children = [0];
    round.nodes!.at(-1)!.children = [];
    expect(() => rigOf(round, new Map())).toThrow("in a circle");
    const lying = character({});
    lying.nodes!.at(-1)!.rotation = [Math.SQRT1_2, 0, 0, Math.SQRT1_2];
    expect(() => fitOf(rigOf(lying, new Map()))).toThrow("does not stand upright");
  });
});

test.each([
  ["Bip001 L Thigh", "left_hip"],
  ["DEF-forearm.R", "right_elbow"],
  ["CC_Base_R_Calf", "right_knee"],
  ["lfemur", "left_hip"],
  ["J_Bip_L_UpperArm", "left_shoulder"],
  ["upperleg.l", "left_hip"],
  ["mixamorig:RightToeBase", "right_foot"],
  ["clavicle_l", "left_collar"],
])("%s is %s", (name, part) => {
  expect([...partsByName([[7, name]])].filter(([, n]) => n === 7).map(([found]) => found)).toContain(part);
});

test("helpers are no bones of the body", () => {
  for (const name of ["LeftForeArmTwist", "foot_IK.L", "Hand_end.R", "thumb.02.L"])
    expect(partsByName([[1, name]]).size, name).toBe(0);
});

test("a file with an animation in it is read as it was written", () => {
  const { content, binary } = unpacked(vrma(body(), "walk"));
  const bones = (content.extensions!.VRMC_vrm_animation as { humanoid: { humanBones: object } }).humanoid.humanBones;
  expect(Object.keys(bones)).toHaveLength(22);
  expect(content.animations).toHaveLength(1);
  const again = unpacked(new Packing(content, binary).bytes());
  expect(again.binary).toEqual(binary);
  expect(again.content).toEqual(content);
  expect(() => unpacked(new TextEncoder().encode("solid a cube that is no GLB").buffer as ArrayBuffer)).toThrow(
    "it is no binary glTF",
  );
  expect(() => unpacked(vrma(body(), "walk").slice(0, 400))).toThrow("its end is missing");
  expect(LENGTHS).toHaveLength(22);
});

test("numbers of a file's own animations go, and no others", () => {
  const content = {
    asset: { version: "2.0" },
    meshes: [{ primitives: [{ attributes: { POSITION: 0 }, indices: 3 }] }],
    animations: [
      {
        samplers: [
          { input: 1, output: 2 },
          { input: 1, output: 0 },
        ],
        channels: [],
      },
    ],
    accessors: [{ bufferView: 0 }, { bufferView: 1 }, { bufferView: 1 }, { bufferView: 2 }],
    bufferViews: [0, 1, 2, 3].map((n) => ({ buffer: 0, byteOffset: 4 * n, byteLength: 4 })),
    images: [{ bufferView: 3 }],
  };
  const left = withoutAnimations(content as Content, new Uint8Array(16).fill(7));
  expect([...left]).toEqual([7, 7, 7, 7, 0, 0, 0, 0, 7, 7, 7, 7, 7, 7, 7, 7]);
});
