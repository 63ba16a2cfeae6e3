/** A figure of turned wood: skins over the 22 joints, set from their places alone. */

import * as THREE from "three";
import { COUNT, HEAD, LEFT, NECK, PELVIS, RIGHT, SIDES, SPINE1, SPINE2, SPINE3, type Side } from "../body/skeleton";
import { Loft, type Ring, solid } from "./loft";
import type { FigureLook } from "./theme";

/** A ring: how far from the first joint to the second (1: there), half its width and depth, how far it is ahead. */
type Station = readonly [number, number, number, number, number?, number?];

const TORSO: readonly Station[] = [
  [PELVIS, SPINE1, -1.28, 0, 0],
  [PELVIS, SPINE1, -1.2, 0.055, 0.05, -0.012],
  [PELVIS, SPINE1, -0.98, 0.11, 0.085, -0.012],
  [PELVIS, SPINE1, -0.58, 0.15, 0.105, -0.008],
  [PELVIS, SPINE1, -0.1, 0.155, 0.112],
  [PELVIS, SPINE1, 0.4, 0.144, 0.104, 0.008],
  [SPINE1, SPINE2, 0, 0.128, 0.095, 0.018],
  [SPINE1, SPINE2, 0.5, 0.124, 0.092, 0.02],
  [SPINE2, SPINE3, 0, 0.131, 0.096, 0.02],
  [SPINE3, NECK, 0, 0.151, 0.106, 0.018],
  [SPINE3, NECK, 0.25, 0.168, 0.116, 0.017],
  [SPINE3, NECK, 0.46, 0.175, 0.115, 0.012],
  [SPINE3, NECK, 0.62, 0.167, 0.102, 0.006],
  [SPINE3, NECK, 0.75, 0.148, 0.084, 0.001],
  [SPINE3, NECK, 0.86, 0.113, 0.069, 0],
  [SPINE3, NECK, 0.95, 0.074, 0.058, 0.002],
  [NECK, HEAD, 0.1, 0.054, 0.052],
  [NECK, HEAD, 0.6, 0.047, 0.05],
  [NECK, HEAD, 1.2, 0.045, 0.048],
];
/** The joints of a side, and what is in the shoulder between the ways of the collarbone and of the arm. */
type Limbs = Side & { readonly inside: number };
const LIMBS: readonly Limbs[] = SIDES.map((side, n) => ({ ...side, inside: COUNT + n }));
/** Metres that it is away from the joint of the shoulder. */
const INSIDE = 0.1;
const BEND = new THREE.Quaternion();
/** Half widths of legs and arms, which are round. */
const LEG: readonly (readonly [keyof Limbs, keyof Limbs, number, number, number?])[] = [
  ["hip", "knee", -0.2, 0],
  ["hip", "knee", -0.19, 0.035],
  ["hip", "knee", -0.15, 0.066],
  ["hip", "knee", -0.07, 0.084],
  ["hip", "knee", 0.06, 0.09],
  ["hip", "knee", 0.22, 0.086],
  ["hip", "knee", 0.42, 0.077],
  ["hip", "knee", 0.6, 0.067],
  ["hip", "knee", 0.75, 0.059],
  ["hip", "knee", 0.86, 0.055],
  ["hip", "knee", 0.94, 0.054, 0.004],
  ["knee", "ankle", 0.0, 0.054, 0.005],
  ["knee", "ankle", 0.06, 0.052, 0.003],
  ["knee", "ankle", 0.14, 0.051, -0.002],
  ["knee", "ankle", 0.26, 0.053, -0.009],
  ["knee", "ankle", 0.4, 0.05, -0.01],
  ["knee", "ankle", 0.58, 0.042, -0.006],
  ["knee", "ankle", 0.75, 0.035],
  ["knee", "ankle", 0.9, 0.031],
  ["knee", "ankle", 1.02, 0.031],
  ["knee", "ankle", 1.07, 0.02],
  ["knee", "ankle", 1.09, 0],
];
const ARM: typeof LEG = [
  ["inside", "shoulder", 0, 0],
  ["inside", "shoulder", 0.03, 0.02],
  ["inside", "shoulder", 0.16, 0.037],
  ["inside", "shoulder", 0.4, 0.0465],
  ["inside", "shoulder", 0.65, 0.051],
  ["inside", "shoulder", 0.9, 0.055],
  ["shoulder", "elbow", 0.07, 0.0585],
  ["shoulder", "elbow", 0.17, 0.0595],
  ["shoulder", "elbow", 0.28, 0.057],
  ["shoulder", "elbow", 0.4, 0.05],
  ["shoulder", "elbow", 0.52, 0.0445],
  ["shoulder", "elbow", 0.65, 0.041],
  ["shoulder", "elbow", 0.78, 0.038],
  ["shoulder", "elbow", 0.9, 0.036],
  ["elbow", "wrist", 0, 0.036],
  ["elbow", "wrist", 0.1, 0.037],
  ["elbow", "wrist", 0.25, 0.038],
  ["elbow", "wrist", 0.45, 0.034],
  ["elbow", "wrist", 0.68, 0.028],
  ["elbow", "wrist", 0.88, 0.0235],
  ["elbow", "wrist", 1.03, 0.022],
];

/** From the right shoulder over the chest to the left one. */
const YOKE: readonly Station[] = [
  [RIGHT.shoulder, RIGHT.collar, -0.02, 0, 0],
  [RIGHT.shoulder, RIGHT.collar, 0.01, 0.028],
  [RIGHT.shoulder, RIGHT.collar, 0.14, 0.045],
  [RIGHT.shoulder, RIGHT.collar, 0.4, 0.053, 0.052],
  [RIGHT.shoulder, RIGHT.collar, 0.72, 0.06, 0.064],
  [RIGHT.collar, LEFT.collar, 0.5, 0.06, 0.07],
  [LEFT.shoulder, LEFT.collar, 0.72, 0.06, 0.064],
  [LEFT.shoulder, LEFT.collar, 0.4, 0.053, 0.052],
  [LEFT.shoulder, LEFT.collar, 0.14, 0.045],
  [LEFT.shoulder, LEFT.collar, 0.01, 0.028],
  [LEFT.shoulder, LEFT.collar, -0.02, 0, 0],
];

/** Hand and thumb from the wrist along +Y, with the thumb on the side of +X and the palm to +Z. */
const HAND = solid(
  [
    [-0.012, 0.021, 0.02],
    [0.012, 0.025, 0.019],
    [0.04, 0.033, 0.018],
    [0.072, 0.038, 0.017, 0.003],
    [0.102, 0.037, 0.0155, 0.009],
    [0.132, 0.033, 0.0135, 0.018],
    [0.156, 0.026, 0.0105, 0.028],
    [0.171, 0.014, 0.0065, 0.034],
    [0.175, 0, 0, 0.036],
  ],
  14,
).geometry;
const THUMB = solid(
  [
    [0, 0.013, 0.013],
    [0.02, 0.0155, 0.014],
    [0.045, 0.0125, 0.012],
    [0.062, 0.011, 0.01],
    [0.072, 0.006, 0.006],
    [0.075, 0, 0],
  ],
  10,
)
  .geometry.rotateZ(-0.62)
  .translate(0.016, 0.018, 0.006);
/** The ankle is so high over the sole, and its way to the ball of the foot goes down by so many radians. */
const [SOLE, SLOPE] = [0.078, Math.atan2(0.06, 0.13)];
const FOOT = foot();
/** The way from neck to head leans ahead by so much where somebody looks ahead. */
const NOD = Math.atan2(0.052, 0.089);
const SKULL = shaped(new THREE.SphereGeometry(1, 24, 18), 0);
const FACE = shaped(
  new THREE.SphereGeometry(1, 32, 24, Math.PI * 0.1, Math.PI * 0.8, Math.PI * 0.15, Math.PI * 0.75),
  1,
);

export class Mannequin {
  readonly group = new THREE.Group();
  private readonly joints = Array.from({ length: COUNT + 2 }, () => new THREE.Vector3());
  private readonly wood: THREE.MeshStandardMaterial;
  private readonly dark: THREE.MeshStandardMaterial;
  private readonly torso = new Loft(TORSO.length, 28);
  private readonly yoke = new Loft(YOKE.length, 14);
  private readonly limbs = SIDES.map(() => ({ arm: new Loft(ARM.length, 14), leg: new Loft(LEG.length, 20) }));
  private readonly head = new THREE.Group();
  private readonly hands = SIDES.map(() => new THREE.Group());
  private readonly feet: THREE.Mesh[];

  constructor(look: FigureLook) {
    this.wood = material(look.body, look);
    this.dark = material(look.joints, look);
    this.group.add(...this.bent().map((geometry) => new THREE.Mesh(geometry, this.wood)));
    this.head.add(new THREE.Mesh(SKULL, this.wood), new THREE.Mesh(FACE, this.dark));
    for (const hand of this.hands) hand.add(new THREE.Mesh(HAND, this.wood), new THREE.Mesh(THUMB, this.wood));
    this.hands[0]!.scale.z = -1; // the palm of a left hand is on the other side
    this.feet = SIDES.map(() => new THREE.Mesh(FOOT, this.dark));
    this.group.add(this.head, ...this.hands, ...this.feet);
    this.group.traverse((one) => (one.frustumCulled = false));
    this.look(look);
  }

  look(look: FigureLook): void {
    this.wood.color.set(look.body);
    this.dark.color.set(look.joints);
    for (const one of [this.wood, this.dark]) {
      one.opacity = look.opacity;
      one.transparent = look.opacity < 1;
      one.depthWrite = look.opacity > 0.4;
    }
    this.group.traverse((one) => (one.castShadow = one.receiveShadow = look.opacity === 1));
  }

  /** Put every joint at its place of (22 * 3) numbers; `look`: the direction of the face, else that of chest and neck. */
  pose(positions: ArrayLike<number>, look: ArrayLike<number> | null = null): void {
    const { joints: j } = this;
    for (let n = 0; n < COUNT; n += 1) j[n]!.set(positions[n * 3]!, positions[n * 3 + 1]!, positions[n * 3 + 2]!);
    const hips = from(j[RIGHT.hip]!, j[LEFT.hip]!).normalize();
    const chest = from(j[RIGHT.collar]!, j[LEFT.collar]!).normalize();
    chest.add(from(j[RIGHT.shoulder]!, j[LEFT.shoulder]!).normalize()).normalize();
    const over = (stations: readonly Station[], side: (ring: number) => THREE.Vector3) =>
      stations.map(([a, b, part, wide, deep = wide, ahead = 0], ring) => {
        return { at: j[a]!.clone().lerp(j[b]!, part), side: side(ring), wide, deep, ahead };
      });
    const spine = from(j[SPINE3]!, j[NECK]!);
    this.torso.over(over(TORSO, (ring) => hips.clone().lerp(chest, Math.min(ring / 9, 1))));
    this.yoke.over(over(YOKE, () => spine));
    const up = from(j[NECK]!, j[HEAD]!).applyAxisAngle(chest, -NOD).normalize();
    if (look) {
      const ahead = new THREE.Vector3(look[0], look[1], look[2]);
      const left = up.clone().cross(ahead);
      turn(this.head, j[HEAD]!, left.lengthSq() > 1e-4 ? left : chest, ahead.cross(left));
    } else turn(this.head, j[HEAD]!, chest, up);
    this.head.translateY(0.075).translateZ(0.006);
    LIMBS.forEach((side, n) => {
      const { arm, leg } = this.limbs[n]!;
      const [thigh, shin] = [from(j[side.hip]!, j[side.knee]!), from(j[side.knee]!, j[side.ankle]!)];
      const [upper, fore] = [from(j[side.shoulder]!, j[side.elbow]!), from(j[side.elbow]!, j[side.wrist]!)];
      // What bends says where its front is; what is straight takes it from hips and shoulders.
      const knee = shin.clone().cross(thigh).multiplyScalar(12).addScaledVector(hips, -0.5);
      const elbow = upper.clone().cross(fore).multiplyScalar(12).addScaledVector(chest, -0.25);
      const inwards = from(j[side.shoulder]!, j[side.collar]!).setLength(3).sub(upper.clone().normalize());
      j[side.inside]!.copy(j[side.shoulder]!).addScaledVector(inwards.normalize(), INSIDE);
      leg.over(this.limb(LEG, side, knee));
      arm.over(this.limb(ARM, side, elbow));
      turn(this.hands[n]!, j[side.wrist]!, elbow.clone().cross(fore), fore);
      const along = from(j[side.ankle]!, j[side.foot]!);
      const across = along.clone().cross(shin);
      turn(this.feet[n]!, j[side.ankle]!, across.lengthSq() > 1e-8 ? across : hips, along.clone().cross(across));
    });
  }

  dispose(): void {
    for (const geometry of this.bent()) geometry.dispose();
    this.wood.dispose();
    this.dark.dispose();
  }

  private bent(): THREE.BufferGeometry[] {
    return [this.torso, this.yoke, ...this.limbs.flatMap(({ arm, leg }) => [arm, leg])].map((one) => one.geometry);
  }

  /** The rings of a limb, with its bends made round. */
  private limb(stations: typeof LEG, joints: Limbs, side: THREE.Vector3): Ring[] {
    const places = stations.map(([a, b, part]) => this.joints[joints[a]]!.clone().lerp(this.joints[joints[b]]!, part));
    const rings = stations.map(([, , , wide, ahead], n) => {
      const [before, at, behind] = [places[n - 1], places[n]!, places[n + 1]];
      const round = before && behind ? at.clone().multiplyScalar(2).add(before).add(behind).multiplyScalar(0.25) : at;
      return { at: round, side, wide, deep: wide, ahead };
    });
    // Inside of the shoulder the rings turn with the way, without a twist.
    for (let n = stations.findIndex(([one]) => one === "shoulder"); n > 0; n -= 1) {
      const [way, next] = [from(rings[n - 1]!.at, rings[n]!.at), from(rings[n]!.at, rings[n + 1]!.at)];
      BEND.setFromUnitVectors(next.normalize(), way.normalize());
      rings[n - 1]!.side = rings[n]!.side.clone().applyQuaternion(BEND);
    }
    return rings;
  }
}

function from(a: THREE.Vector3, b: THREE.Vector3): THREE.Vector3 {
  return b.clone().sub(a);
}

/** Put something at a place, with its +Y along `up` and its +X as near to `side` as that allows. */
function turn(what: THREE.Object3D, at: THREE.Vector3, side: THREE.Vector3, up: THREE.Vector3): void {
  const y = up.clone().normalize();
  const x = side.clone().addScaledVector(y, -side.dot(y)).normalize();
  what.quaternion.setFromRotationMatrix(new THREE.Matrix4().makeBasis(x, y, x.clone().cross(y)));
  what.position.copy(at);
}

/** A shoe from the ankle: its sole lies flat where the way to the ball of the foot goes down as it does at rest. */
function foot(): THREE.BufferGeometry {
  const rings = [
    [-0.085, 0, 0.04],
    [-0.081, 0.018, 0.05],
    [-0.066, 0.031, 0.078],
    [-0.035, 0.037, 0.112],
    [0.005, 0.039, 0.118],
    [0.042, 0.04, 0.097],
    [0.085, 0.044, 0.066],
    [0.125, 0.048, 0.052],
    [0.16, 0.046, 0.045],
    [0.185, 0.036, 0.038],
    [0.2, 0.02, 0.03],
    [0.205, 0, 0.02],
  ] as const;
  const side = new THREE.Vector3(-1, 0, 0);
  const shoe = new Loft(rings.length, 16).over(
    rings.map(([z, wide, high]) => ({
      at: new THREE.Vector3(0, high / 2 - SOLE, z),
      side,
      wide,
      deep: wide && high * 0.5 + 0.008,
    })),
    -SOLE,
  );
  return shoe.geometry.rotateX(-SLOPE);
}

/** A ball as a head: a narrow jaw and a flat front; `lift` 1: the face on it, with brow and nose. */
function shaped(ball: THREE.BufferGeometry, lift: number): THREE.BufferGeometry {
  const places = ball.getAttribute("position");
  for (let n = 0; n < places.count; n += 1) {
    const [x, y, z] = [places.getX(n), places.getY(n), places.getZ(n)];
    const [jaw, front] = [Math.max(-y, 0), Math.max(z, 0)];
    const nose = Math.exp(-((x / 0.2) ** 2) - ((y + 0.14) / 0.24) ** 2);
    const brow = Math.exp(-((x / 0.75) ** 2) - ((y - 0.3) / 0.12) ** 2);
    // Outside of an oval the face is below the skull.
    const oval = 1 - (x / 0.74) ** 2 - ((y + 0.08) / 0.78) ** 2;
    const out = lift * (0.03 * Math.min(oval, 0.16) + front * (0.015 * nose + 0.004 * brow));
    places.setXYZ(
      n,
      x * 0.077 * (1 - 0.3 * jaw ** 1.5),
      y * (y > 0 ? 0.108 : 0.112),
      (z > 0 ? 0.09 * z ** 0.75 : 0.1 * z) + 0.012 * jaw * front + out,
    );
  }
  ball.computeVertexNormals();
  return ball;
}

function material(color: string, look: FigureLook): THREE.MeshStandardMaterial {
  return new THREE.MeshStandardMaterial({ color, roughness: 0.62, metalness: 0, opacity: look.opacity });
}
