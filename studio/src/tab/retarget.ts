/**
 * The uniform person's motion on somebody else's bones: every part of the body is turned in the world as the person's is
 * from a T-pose, the way shrinks with the legs, and ankles go where the person's are, so that planted feet stay.
 */

import { JOINTS, LEFT, PELVIS, RIGHT, SPINE1, SPINE2, SPINE3 } from "../body/skeleton";
import { type Body, HEAD, LENGTHS, NECK, REST, placesOf, worldOf } from "../prior/person";
import {
  IDENTITY,
  type Turn,
  type Vec,
  aboutAxis,
  add,
  dot,
  inverse,
  minus,
  norm,
  rotate,
  scaled,
  shortestArc,
  slerp,
  times,
  unit,
  unroll,
} from "../prior/turns";
import type { Moves } from "./glbFile";
import { type Pose, type Rig, WORLD, hung, unhung } from "./rig";

/** Metres from ankles to head of what is shown in its own size, and of what is not. */
const [SHORT, TALL, PLAIN] = [0.5, 2.2, 1.5] as const;
/** Bones that are laid along the person's: joint, and the joint that it ends at. */
const LIMBS = [LEFT, RIGHT].flatMap(({ hip, knee, ankle, shoulder, elbow, wrist }) => [
  [hip, knee],
  [knee, ankle],
  [shoulder, elbow],
  [elbow, wrist],
]) as [number, number][];
const LEG = [LEFT, RIGHT].reduce((sum, { knee, ankle }) => sum + (LENGTHS[knee]! + LENGTHS[ankle]!) / 2, 0);
/** Metres over the floor, of the person's ankles at rest. */
const ANKLE = [LEFT, RIGHT].reduce(
  (sum, { hip, knee, ankle }) => sum + [PELVIS, hip, knee, ankle].reduce((y, j) => y + REST[j]![1], 0) / 2,
  0,
);

/** How a character's bones follow those of the person. */
export interface Fit {
  readonly rig: Rig;
  /** The character's leg in lengths of the person's, as big as it is shown. */
  readonly ratio: number;
  /** By number: each bone at rest in its parent. */
  readonly local: readonly Pose[];
  /** Bones whose place in the world says where followers go: those, and what they hang on; parents first. */
  readonly line: readonly number[];
  /** By how much the file's character is made larger to be shown. */
  readonly size: number;
  /** Per bone that follows: two of the person's joints between which it does, how far, and its turn at their rest. */
  readonly followers: ReadonlyMap<number, { from: number; to: number; share: number; rest: Turn }>;
}

/** An Error says in a sentence why nobody can move in it. */
export function fitOf(rig: Rig): Fit {
  const at = (name: string): Vec => rig.rest[rig.parts.get(name)!]!.place;
  const apart = (a: string, b: string): number => norm(minus(at(a), at(b)));
  const leg = ["left", "right"].reduce(
    (sum, side) => sum + (apart(`${side}_hip`, `${side}_knee`) + apart(`${side}_knee`, `${side}_ankle`)) / 2,
    0,
  );
  const [top, feet] = [mean(at("left_hip"), at("right_hip")), mean(at("left_ankle"), at("right_ankle"))];
  if (!(leg > 1e-6) || top[1] - feet[1] < 0.4 * leg)
    throw new Error("it does not stand upright at rest; export it in a T-pose, +Y up");
  const across = add(minus(at("left_hip"), at("right_hip")), minus(at("left_shoulder"), at("right_shoulder")));
  const facing = aboutAxis([0, 1, 0], Math.atan2(across[2], across[0]));
  const head = rig.parts.get("head");
  const height =
    (head === undefined ? mean(at("left_shoulder"), at("right_shoulder")) : rig.rest[head]!.place)[1] - feet[1];
  const size = height > SHORT && height < TALL ? 1 : PLAIN / Math.max(height, leg);
  const followers = followersOf(rig, facing);
  const local: Pose[] = [];
  for (const n of rig.order) local[n] = localOf(rig, rig.rest, n);
  const line = new Set<number>();
  for (const follower of followers.keys()) for (let n = follower; n >= 0; n = rig.bones[n]!.parent) line.add(n);
  return { rig, ratio: (leg * size) / LEG, size, followers, local, line: rig.order.filter((n) => line.has(n)) };
}

const mean = (a: Vec, b: Vec): Vec => scaled(add(a, b), 0.5);

function followersOf(rig: Rig, facing: Turn): Fit["followers"] {
  const found = new Map<number, { from: number; to: number; share: number; rest: Turn }>();
  const put = (bone: number | undefined, from: number, to = from, share = 0, lay: Turn = IDENTITY): void => {
    if (bone !== undefined && !found.has(bone))
      found.set(bone, { from, to, share, rest: times(times(lay, facing), rig.rest[bone]!.turn) });
  };
  put(rig.parts.get("pelvis"), PELVIS);
  const trunk = [PELVIS, SPINE1, SPINE2, SPINE3];
  rig.spine.forEach((bone, n) => {
    const along = (3 * (n + 1)) / rig.spine.length;
    const low = Math.min(Math.floor(along), 2);
    put(bone, trunk[low]!, trunk[low + 1]!, along - low);
  });
  rig.neck.forEach((bone, n) => put(bone, SPINE3, NECK, (n + 1) / rig.neck.length));
  put(rig.parts.get("head"), HEAD);
  for (const side of [LEFT, RIGHT]) for (const one of [side.collar, side.ankle]) put(rig.parts.get(JOINTS[one]!), one);
  const lays = new Map<number, Turn>();
  for (const [start, end] of LIMBS) {
    const [bone, next] = [rig.parts.get(JOINTS[start]!)!, rig.parts.get(JOINTS[end]!)];
    const way = next === undefined ? null : rotate(facing, minus(rig.rest[next]!.place, rig.rest[bone]!.place));
    const before = lays.get(start === LEFT.elbow ? LEFT.shoulder : RIGHT.shoulder) ?? IDENTITY;
    lays.set(start, way ? shortestArc(way, REST[end]!) : before);
    put(bone, start, start, 0, lays.get(start));
  }
  for (const { elbow, wrist } of [LEFT, RIGHT]) put(rig.parts.get(JOINTS[wrist]!), wrist, wrist, 0, lays.get(elbow));
  return found;
}

/** How the file's nodes move; `size` of the fit is for whoever shows it. */
export function retargeted(body: Body, fit: Fit): Moves {
  const { rig, followers, local } = fit;
  const [turns, places] = [new Map<number, Turn[]>(), new Map<number, Vec[]>()];
  const seen = placesOf(body);
  const pinned = pinnedOf(rig);
  const changed = rig.order.filter((n) => followers.has(n));
  const still = rig.order.filter((n) => !followers.has(n) && turnedAtRest(rig.bones[n]!.turn, local[n]!.turn));
  for (const n of changed) turns.set(n, []);
  for (const n of pinned.keys()) places.set(n, []);
  body.turns.forEach((own, f) => {
    const world = posed(fit, worldOf(own), seen[f]!, pinned);
    for (const n of changed) turns.get(n)!.push(localOf(rig, world, n).turn);
    for (const n of pinned.keys()) places.get(n)!.push(localOf(rig, world, n).place);
  });
  for (const own of turns.values()) unroll(own);
  for (const n of still)
    turns.set(
      n,
      body.turns.map(() => local[n]!.turn),
    ); // a finger that the file has in a fist
  return { fps: body.fps, turns, places };
}

const localOf = (rig: Rig, world: readonly Pose[], n: number): Pose =>
  unhung(rig.bones[n]!.parent < 0 ? WORLD : world[rig.bones[n]!.parent]!, world[n]!);

/** Whether a bone was bound in another turn than the file has it in. */
function turnedAtRest(a: Turn, b: Turn): boolean {
  return Math.abs(a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3]) < 1 - 1e-6;
}

/** Bones whose place is set, not only their turn: the pelvis, and legs and feet that do not hang on what moves them. */
function pinnedOf(rig: Rig): Map<number, string> {
  const found = new Map([[rig.parts.get("pelvis")!, "pelvis"]]);
  for (const side of ["left", "right"]) {
    for (const [part, on] of [
      ["hip", "pelvis"],
      ["ankle", `${side}_knee`],
    ] as const) {
      const bone = rig.parts.get(`${side}_${part}`)!;
      let above = bone;
      while (above >= 0 && above !== rig.parts.get(on)) above = rig.bones[above]!.parent;
      if (above < 0) found.set(bone, `${side}_${part}`);
    }
  }
  return found;
}

/** All bones in the world in one frame, in the file's own size. */
function posed(
  { rig, ratio, size, followers, local, line }: Fit,
  turns: readonly Turn[],
  seen: readonly Vec[],
  pinned: ReadonlyMap<number, string>,
): Pose[] {
  const scale = ratio / size;
  const at = (name: string): Vec => rig.rest[rig.parts.get(name)!]!.place;
  const lift = mean(at("left_ankle"), at("right_ankle"))[1] - floorOf(rig) - ANKLE * scale;
  const middle = add(scaled(mean(seen[LEFT.hip]!, seen[RIGHT.hip]!), scale), [0, lift, 0]);
  const pelvis = rig.rest[rig.parts.get("pelvis")!]!;
  const turn = new Map<number, Turn>();
  for (const [n, { from, to, share, rest }] of followers)
    turn.set(n, times(share ? slerp(turns[from]!, turns[to]!, share) : turns[from]!, rest));
  const moved = times(turn.get(rig.parts.get("pelvis")!)!, inverse(pelvis.turn));
  const fixed = (name: string): Vec =>
    add(middle, rotate(moved, minus(at(name), mean(at("left_hip"), at("right_hip")))));
  const legs = [LEFT, RIGHT].flatMap((side, n) => {
    const name = n ? "right" : "left";
    return bentLeg(rig, name, fixed(`${name}_hip`), turn, seen, turns[side.hip]!, scale, side);
  });
  const ankles = new Map(legs);
  const world: Pose[] = [];
  for (const n of line) {
    const { parent } = rig.bones[n]!;
    const plain = hung(parent < 0 ? WORLD : world[parent]!, local[n]!);
    const pin = pinned.get(n);
    world[n] = {
      ...plain,
      turn: turn.get(n) ?? plain.turn,
      place: pin ? (ankles.get(n) ?? fixed(pin)) : plain.place,
    };
  }
  return world;
}

/** Where the floor is under a character that stands: at 0, or under its feet if it is made about another place. */
function floorOf(rig: Rig): number {
  const at = (name: string): Vec => rig.rest[rig.parts.get(name)!]!.place;
  const [ankle, hip] = [mean(at("left_ankle"), at("right_ankle"))[1], mean(at("left_hip"), at("right_hip"))[1]];
  return ankle > -0.05 * (hip - ankle) && ankle < 0.6 * (hip - ankle) ? 0 : ankle - 0.1 * (hip - ankle);
}

/** Turn thigh and shin, in place, so that the ankle is where the person's is; gives the ankle's bone and place. */
function bentLeg(
  rig: Rig,
  side: string,
  hip: Vec,
  turn: Map<number, Turn>,
  seen: readonly Vec[],
  thighTurn: Turn,
  scale: number,
  joints: typeof LEFT,
): [number, Vec][] {
  const bone = (part: string): number => rig.parts.get(`${side}_${part}`)!;
  const rest = (part: string): Vec => rig.rest[bone(part)]!.place;
  const [upper, lower] = [norm(minus(rest("knee"), rest("hip"))), norm(minus(rest("ankle"), rest("knee")))];
  const line = scaled(minus(seen[joints.ankle]!, seen[joints.hip]!), scale);
  const way = unit(line);
  const far = Math.min(norm(line), (upper + lower) * 0.9999);
  const out = minus(seen[joints.knee]!, seen[joints.hip]!);
  const pole = add(add(out, way, -dot(out, way)), rotate(thighTurn, [0, 0, 1]), 0.03 * LEG);
  const side2 = unit(add(pole, way, -dot(pole, way)));
  const along = (upper * upper - lower * lower + far * far) / (2 * Math.max(far, 1e-9));
  const knee = add(add(hip, way, along), side2, Math.sqrt(Math.max(upper * upper - along * along, 0)));
  const ankle = add(hip, way, far);
  const lay = (part: string, next: string, wanted: Vec): void => {
    const n = bone(part);
    const own = rotate(times(turn.get(n)!, inverse(rig.rest[n]!.turn)), minus(rest(next), rest(part)));
    turn.set(n, times(shortestArc(own, wanted), turn.get(n)!));
  };
  lay("hip", "knee", minus(knee, hip));
  lay("knee", "ankle", minus(ankle, knee));
  return [[bone("ankle"), ankle]];
}
