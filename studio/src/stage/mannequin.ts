/** A figure of turned wood: capsules between the 22 joints, set from their places alone. */

import * as THREE from "three";
import { HEAD, LEFT, NECK, PELVIS, RIGHT, SIDES, SPINE1, SPINE2, SPINE3 } from "../body/skeleton";
import type { FigureLook } from "./theme";

/** From joint, to joint, radius there and here (metres). */
const LIMBS: readonly (readonly [number, number, number, number])[] = [
  ...SIDES.flatMap(({ hip, knee, ankle, collar, shoulder, elbow, wrist }) => [
    [hip, knee, 0.082, 0.054] as const,
    [knee, ankle, 0.054, 0.034] as const,
    [collar, shoulder, 0.045, 0.048] as const,
    [shoulder, elbow, 0.047, 0.036] as const,
    [elbow, wrist, 0.037, 0.025] as const,
  ]),
  [NECK, HEAD, 0.042, 0.04],
];

/** Balls where limbs meet. */
const BALLS: readonly (readonly [number, number])[] = SIDES.flatMap(({ knee, ankle, shoulder, elbow, wrist }) => [
  [knee, 0.056] as const,
  [ankle, 0.038] as const,
  [shoulder, 0.055] as const,
  [elbow, 0.04] as const,
  [wrist, 0.028] as const,
]);

interface Part {
  readonly mesh: THREE.Mesh;
  place(joints: readonly THREE.Vector3[], frame: Frame): void;
}

/** Directions of the body that the places give. */
interface Frame {
  readonly hips: THREE.Vector3;
  readonly chest: THREE.Vector3;
  readonly chestUp: THREE.Vector3;
  readonly pelvisUp: THREE.Vector3;
  readonly face: THREE.Vector3;
}

const UP = new THREE.Vector3(0, 1, 0);
const BALL = new THREE.SphereGeometry(1, 24, 16);
/** For what is a few centimetres large. */
const SMALL = new THREE.SphereGeometry(1, 16, 10);

export class Mannequin {
  readonly group = new THREE.Group();
  /** Where the joints are. */
  readonly joints: THREE.Vector3[] = Array.from({ length: 22 }, () => new THREE.Vector3());
  private readonly wood: THREE.MeshStandardMaterial;
  private readonly dark: THREE.MeshStandardMaterial;
  private readonly parts: Part[];

  constructor(look: FigureLook) {
    this.wood = material(look.body, look);
    this.dark = material(look.joints, look);
    this.parts = [
      ...LIMBS.map(([from, to, near, far]) => this.limb(from, to, near, far)),
      ...BALLS.map(([joint, radius]) => this.ball(joint, radius)),
      ...this.torso(),
      this.head(),
      this.nose(),
      ...SIDES.map(({ elbow, wrist }) => this.hand(elbow, wrist)),
      ...SIDES.map(({ knee, ankle, foot }) => this.foot(knee, ankle, foot)),
    ];
    for (const { mesh } of this.parts) {
      mesh.castShadow = look.opacity === 1;
      mesh.receiveShadow = look.opacity === 1;
      this.group.add(mesh);
    }
  }

  look(look: FigureLook): void {
    this.wood.color.set(look.body);
    this.dark.color.set(look.joints);
    for (const one of [this.wood, this.dark]) {
      one.opacity = look.opacity;
      one.transparent = look.opacity < 1;
      one.depthWrite = look.opacity > 0.4;
    }
    for (const { mesh } of this.parts) mesh.castShadow = mesh.receiveShadow = look.opacity === 1;
  }

  /** Put every joint at its place of (22 * 3) numbers. */
  pose(positions: ArrayLike<number>): void {
    this.joints.forEach((joint, n) => joint.set(positions[n * 3]!, positions[n * 3 + 1]!, positions[n * 3 + 2]!));
    const frame = frameOf(this.joints);
    for (const part of this.parts) part.place(this.joints, frame);
  }

  dispose(): void {
    for (const { mesh } of this.parts) if (mesh.geometry !== BALL && mesh.geometry !== SMALL) mesh.geometry.dispose();
    this.wood.dispose();
    this.dark.dispose();
  }

  private limb(from: number, to: number, near: number, far: number): Part {
    const mesh = new THREE.Mesh(taper(near, far), this.wood);
    return { mesh, place: (joints) => between(mesh, joints[from]!, joints[to]!) };
  }

  private ball(joint: number, radius: number): Part {
    const mesh = new THREE.Mesh(SMALL, this.dark);
    mesh.scale.setScalar(radius);
    return { mesh, place: (joints) => mesh.position.copy(joints[joint]!) };
  }

  /** Pelvis, waist and chest: ellipsoids that turn with hips and shoulders. */
  private torso(): Part[] {
    const pelvis = new THREE.Mesh(BALL, this.wood);
    const waist = new THREE.Mesh(BALL, this.wood);
    const belly = new THREE.Mesh(BALL, this.wood);
    const chest = new THREE.Mesh(BALL, this.wood);
    const middle = new THREE.Vector3();
    return [
      {
        mesh: pelvis,
        place: (j, f) =>
          ellipsoid(
            pelvis,
            middle.lerpVectors(j[PELVIS]!, j[LEFT.hip]!.clone().add(j[RIGHT.hip]!).multiplyScalar(0.5), 0.35),
            f.hips,
            f.pelvisUp,
            [0.15, 0.115, 0.112],
          ),
      },
      {
        mesh: waist,
        place: (j, f) =>
          ellipsoid(waist, middle.lerpVectors(j[SPINE1]!, j[SPINE2]!, 0.1), f.hips, f.pelvisUp, [0.12, 0.105, 0.092]),
      },
      { mesh: belly, place: (j, f) => ellipsoid(belly, j[SPINE2]!, f.chest, f.chestUp, [0.132, 0.125, 0.1]) },
      {
        mesh: chest,
        place: (j, f) =>
          ellipsoid(chest, middle.lerpVectors(j[SPINE3]!, j[NECK]!, 0.3), f.chest, f.chestUp, [0.162, 0.165, 0.112]),
      },
    ];
  }

  private head(): Part {
    const mesh = new THREE.Mesh(BALL, this.wood);
    const centre = new THREE.Vector3();
    return {
      mesh,
      place: (joints, frame) => {
        const up = centre.copy(joints[HEAD]!).sub(joints[NECK]!).normalize().clone();
        centre.copy(joints[HEAD]!).addScaledVector(up, 0.07).addScaledVector(frame.face, 0.02);
        ellipsoid(mesh, centre, frame.chest, up, [0.083, 0.118, 0.1]);
      },
    };
  }

  /** Which way somebody looks. */
  private nose(): Part {
    const mesh = new THREE.Mesh(SMALL, this.dark);
    return {
      mesh,
      place: (joints, frame) => {
        const up = joints[HEAD]!.clone().sub(joints[NECK]!).normalize();
        const at = joints[HEAD]!.clone().addScaledVector(up, 0.075).addScaledVector(frame.face, 0.112);
        ellipsoid(mesh, at, frame.chest, up, [0.05, 0.014, 0.014]);
      },
    };
  }

  private hand(elbow: number, wrist: number): Part {
    const mesh = new THREE.Mesh(SMALL, this.wood);
    return {
      mesh,
      place: (joints, frame) => {
        const along = joints[wrist]!.clone().sub(joints[elbow]!).normalize();
        ellipsoid(mesh, joints[wrist]!.clone().addScaledVector(along, 0.075), frame.face, along, [0.038, 0.082, 0.022]);
      },
    };
  }

  private foot(knee: number, ankle: number, toe: number): Part {
    const mesh = new THREE.Mesh(BALL, this.wood);
    return {
      mesh,
      place: (joints) => {
        const along = joints[toe]!.clone().sub(joints[ankle]!);
        const shin = joints[knee]!.clone().sub(joints[ankle]!);
        const side = along.clone().cross(shin);
        const middle = joints[ankle]!.clone().lerp(joints[toe]!, 0.62);
        ellipsoid(
          mesh,
          middle,
          side.lengthSq() > 1e-8 ? side : new THREE.Vector3(1, 0, 0),
          along,
          [0.045, 0.13, 0.036],
        );
      },
    };
  }
}

function material(color: string, look: FigureLook): THREE.MeshStandardMaterial {
  return new THREE.MeshStandardMaterial({
    color,
    roughness: 0.62,
    metalness: 0,
    transparent: look.opacity < 1,
    opacity: look.opacity,
    depthWrite: look.opacity > 0.4,
  });
}

function frameOf(j: readonly THREE.Vector3[]): Frame {
  const hips = j[LEFT.hip]!.clone().sub(j[RIGHT.hip]!).normalize();
  const chest = j[LEFT.shoulder]!.clone().sub(j[RIGHT.shoulder]!).normalize();
  const chestUp = j[NECK]!.clone().sub(j[SPINE2]!).normalize();
  const pelvisUp = j[SPINE2]!.clone().sub(j[PELVIS]!).normalize();
  const headUp = j[HEAD]!.clone().sub(j[NECK]!).normalize();
  const collars = j[LEFT.collar]!.clone().sub(j[RIGHT.collar]!).normalize().add(chest).normalize();
  return { hips, chest, chestUp, pelvisUp, face: collars.cross(headUp).normalize() };
}

/** Rings of each round end. */
const RINGS = 4;

/** A capsule of length 1 from the origin along +Y, thinner towards its end. */
function taper(near: number, far: number): THREE.BufferGeometry {
  const points: THREE.Vector2[] = [];
  for (let n = 0; n <= RINGS; n += 1) points.push(cap(near, 0, -Math.PI / 2 + (n / RINGS) * (Math.PI / 2)));
  for (let n = 0; n <= RINGS; n += 1) points.push(cap(far, 1, (n / RINGS) * (Math.PI / 2)));
  return new THREE.LatheGeometry(points, 18);
}

function cap(radius: number, height: number, angle: number): THREE.Vector2 {
  // The limb is stretched to its length, some 0.35 m, so its round ends are drawn longer by as much.
  return new THREE.Vector2(Math.max(Math.cos(angle) * radius, 1e-4), height + Math.sin(angle) * radius * 2.5);
}

function between(mesh: THREE.Mesh, from: THREE.Vector3, to: THREE.Vector3): void {
  const way = to.clone().sub(from);
  const size = Math.max(way.length(), 1e-4);
  mesh.position.copy(from);
  mesh.quaternion.setFromUnitVectors(UP, way.divideScalar(size));
  mesh.scale.set(1, size, 1);
}

/** Radii along `side`, `up` and what is square to both. */
function ellipsoid(
  mesh: THREE.Mesh,
  at: THREE.Vector3,
  side: THREE.Vector3,
  up: THREE.Vector3,
  radii: readonly [number, number, number],
): void {
  const y = up.clone().normalize();
  const x = side.clone().addScaledVector(y, -side.dot(y)).normalize();
  const z = x.clone().cross(y);
  mesh.quaternion.setFromRotationMatrix(new THREE.Matrix4().makeBasis(x, y, z));
  mesh.position.copy(at);
  mesh.scale.set(...radii);
}
