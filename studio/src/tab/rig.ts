/** The skeleton of somebody's own character: its bones, how they rest, and which part of the body each one is. */

import {
  type Turn,
  type Vec,
  add,
  inverse,
  minus,
  norm,
  normalized,
  ofColumns,
  rotate,
  scaled,
  times,
} from "../prior/turns";
import type { Content } from "./glbFile";
import { ofVrm, partsByName } from "./names";

export interface Bone {
  readonly name: string;
  readonly parent: number;
  /** In the parent's frame, as the file has it. */
  readonly place: Vec;
  readonly turn: Turn;
  readonly size: number;
}

/** A place, a turn and a size in the world. */
export interface Pose {
  readonly place: Vec;
  readonly turn: Turn;
  readonly size: number;
}

export interface Rig {
  readonly bones: readonly Bone[];
  /** Numbers of the bones, parents first. */
  readonly order: readonly number[];
  /** By number: at rest, in the world. */
  readonly rest: readonly Pose[];
  /** "left_knee" and the like to a bone's number. */
  readonly parts: ReadonlyMap<string, number>;
  /** Bones between the pelvis and the neck, and between those and the head, upwards. */
  readonly spine: readonly number[];
  readonly neck: readonly number[];
}

const NEEDED = ["hip", "knee", "ankle", "shoulder", "elbow"].flatMap((part) => [`left_${part}`, `right_${part}`]);

/** `bind`: where a skin's bones were bound, by number; an Error says in a sentence why nobody can move in it. */
export function rigOf(content: Content, bind: ReadonlyMap<number, Pose>): Rig {
  const bones = bonesOf(content);
  const order = ordered(bones);
  const joints = new Set(content.skins?.flatMap((skin) => skin.joints) ?? []);
  if (!joints.size) throw new Error("no skeleton moves its mesh; drop a character with a skeleton");
  const parts = partsOf(
    content,
    order.filter((n) => joints.has(n)).map((n) => [n, bones[n]!.name]),
  );
  const missing = NEEDED.filter((part) => !parts.has(part));
  if (missing.length) {
    const listing = missing.slice(0, 3).map((part) => part.replace("_", " "));
    throw new Error(
      `its skeleton has no ${listing.join(", ")}${missing.length > 3 ? ` and ${missing.length - 3} more` : ""} by name; use a VRM or names as Mixamo has them`,
    );
  }
  const rest = standing(bones, order, bind);
  const above = (n: number): number[] => (n < 0 ? [] : [n, ...above(bones[n]!.parent)]);
  const carried = ["left_hip", "right_hip", "left_shoulder"].map((part) => above(parts.get(part)!));
  if (!parts.has("pelvis") || !carried.every((line) => line.slice(1).includes(parts.get("pelvis")!))) {
    const shared = carried[0]!.slice(1).find((n) => carried.every((line) => line.includes(n)));
    if (shared === undefined) throw new Error("its legs hang on different skeletons; join them");
    parts.set("pelvis", shared);
  }
  const pelvis = above(parts.get("pelvis")!);
  const until = (n: number): number[] => above(n).filter((one) => !pelvis.includes(one) && joints.has(one));
  const arms = until(parts.get("right_shoulder")!);
  const spine = until(parts.get("left_shoulder")!)
    .filter((n) => arms.includes(n))
    .reverse();
  const head = parts.get("head") ?? topOf(bones, order, joints, spine.at(-1));
  if (head !== undefined) parts.set("head", head);
  const neck =
    head === undefined
      ? []
      : until(head)
          .slice(1)
          .filter((n) => !spine.includes(n))
          .reverse();
  return { bones, order, rest, parts, spine, neck };
}

/** The uppermost bone of a neck and head that go on with the spine's names, as Rigify's do; none: there is none. */
function topOf(
  bones: readonly Bone[],
  order: readonly number[],
  joints: Set<number>,
  chest?: number,
): number | undefined {
  let top: number | undefined;
  for (let n = chest; n !== undefined; top = n ?? top)
    n = order.find((k) => joints.has(k) && bones[k]!.parent === n && /spine|neck|head/i.test(bones[k]!.name));
  return top;
}

function partsOf(content: Content, names: readonly (readonly [number, string])[]): Map<string, number> {
  const { VRM, VRMC_vrm } = (content.extensions ?? {}) as Record<string, { humanoid?: { humanBones?: unknown } }>;
  const bones = VRMC_vrm?.humanoid?.humanBones ?? VRM?.humanoid?.humanBones;
  if (!bones || typeof bones !== "object") return partsByName(names);
  const listed: [string, unknown][] = Array.isArray(bones)
    ? (bones as { bone: string; node: number }[]).map(({ bone, node }) => [bone, node])
    : Object.entries(bones as Record<string, { node?: number }>).map(([bone, one]) => [bone, one?.node]);
  const parts = new Map<string, number>();
  for (const [bone, node] of listed) {
    const part = ofVrm(String(bone));
    if (part && typeof node === "number" && content.nodes?.[node]) parts.set(part, node);
  }
  return parts;
}

function bonesOf({ nodes = [] }: Content): Bone[] {
  const parents = nodes.map(() => -1);
  nodes.forEach(({ children = [] }, n) => children.forEach((child) => (parents[child] = n)));
  return nodes.map(({ name, translation, rotation, scale, matrix }, n): Bone => {
    const base = { name: name ?? "", parent: parents[n]! };
    if (matrix) return { ...base, ...poseOf(matrix) };
    const [x = 0, y = 0, z = 0, w = 1] = rotation ?? [];
    return {
      ...base,
      place: [translation?.[0] ?? 0, translation?.[1] ?? 0, translation?.[2] ?? 0],
      turn: normalized([w, x, y, z]),
      size: scale ? Math.cbrt(Math.abs(scale[0]! * scale[1]! * scale[2]!)) : 1,
    };
  });
}

/** Of a matrix in columns. */
export function poseOf(m: ArrayLike<number>): Pose {
  const column = (k: number): Vec => [m[4 * k]!, m[4 * k + 1]!, m[4 * k + 2]!];
  const [a, b, c] = [column(0), column(1), column(2)];
  const sizes = [norm(a), norm(b), norm(c)].map((one) => Math.max(one, 1e-12));
  const turn = ofColumns(scaled(a, 1 / sizes[0]!), scaled(b, 1 / sizes[1]!), scaled(c, 1 / sizes[2]!));
  return { place: column(3), turn, size: Math.cbrt(sizes[0]! * sizes[1]! * sizes[2]!) };
}

/** First `a`, which hangs on `on`. */
export function hung(on: Pose, a: Pose): Pose {
  return {
    place: add(on.place, scaled(rotate(on.turn, a.place), on.size)),
    turn: normalized(times(on.turn, a.turn)),
    size: on.size * a.size,
  };
}

/** What `a` is, seen from `on`. */
export function unhung(on: Pose, a: Pose): Pose {
  const back = inverse(on.turn);
  return {
    place: scaled(rotate(back, minus(a.place, on.place)), 1 / on.size),
    turn: normalized(times(back, a.turn)),
    size: a.size / on.size,
  };
}

export const WORLD: Pose = { place: [0, 0, 0], turn: [1, 0, 0, 0], size: 1 };

function ordered(bones: readonly Bone[]): number[] {
  const order: number[] = [];
  const seen = new Set<number>();
  const visit = (n: number): void => {
    if (seen.has(n)) return;
    seen.add(n);
    order.push(n);
    bones.forEach(({ parent }, k) => parent === n && visit(k));
  };
  bones.forEach(({ parent }, n) => parent < 0 && visit(n));
  if (order.length < bones.length) throw new Error("its nodes hang on each other in a circle; export it again");
  return order;
}

/** In the world: bones as they were bound, the topmost where the file has it, all others as the file has them. */
function standing(bones: readonly Bone[], order: readonly number[], bind: ReadonlyMap<number, Pose>): Pose[] {
  const rest: Pose[] = [];
  let space: Pose | null = null;
  for (const n of order) {
    const bone = bones[n]!;
    const plain = hung(bone.parent < 0 ? WORLD : rest[bone.parent]!, bone);
    const bound = bind.get(n);
    if (bound && !space) space = hung(plain, unhung(bound, WORLD));
    rest[n] = bound ? { ...hung(space!, bound), size: plain.size } : plain;
  }
  return rest;
}
