/** Somebody's own character: read from a dropped file, moved on the stage, and written with the motion in it. */

import * as THREE from "three";
import { type GLTF, GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import { MeshoptDecoder } from "three/addons/libs/meshopt_decoder.module.js";
import type { Body } from "../prior/person";
import { type Actor, actorOf, inside } from "../stage/actor";
import { type Content, type Moves, Packing, unpacked, withoutAnimations } from "./glbFile";
import { type Fit, fitOf, retargeted } from "./retarget";
import { type Pose, hung, poseOf, rigOf, unhung, WORLD } from "./rig";

/** Bytes of the largest file that is opened. */
const MOST = 150e6;
/** Quaternions and metres of a motion in a page are multiples of it: 0.01 degrees, 0.1 millimetres. */
const GRAIN = 2 ** -13;
const LOCKED = ["KHR_draco_mesh_compression", "KHR_texture_basisu"];

export class Character {
  private constructor(
    readonly name: string,
    private readonly content: Content,
    private readonly binary: Uint8Array,
    private readonly gltf: GLTF,
    private readonly fit: Fit,
  ) {}

  /** Of a file; an Error says in a sentence why it cannot be used. */
  static async open(file: File): Promise<Character> {
    try {
      if (file.size > MOST) throw new Error(`it has ${(file.size / 1e6).toFixed(0)} MB; use one of at most 150`);
      const data = await file.arrayBuffer();
      const { content, binary } = unpacked(data);
      const locked = content.extensionsRequired?.find((one) => LOCKED.includes(one));
      if (locked) throw new Error(`it is packed with ${locked}; export it without that`);
      if (content.buffers?.[0]?.uri) throw new Error("its numbers lie in other files; export it as one GLB");
      const gltf = await new GLTFLoader(inside)
        .setMeshoptDecoder(MeshoptDecoder)
        .parseAsync(data, "")
        .catch((error: Error) => {
          throw new Error(`it cannot be read (${error.message.slice(0, 120)}); export it again`);
        });
      const fit = fitOf(rigOf(content, boundIn(gltf)));
      return new Character(file.name.replace(/\.\w+$/, "").slice(0, 40) || "character", content, binary, gltf, fit);
    } catch (error) {
      throw new Error(`${file.name.slice(0, 60)} cannot be used: ${(error as Error).message}.`);
    }
  }

  /** Who plays a motion on the stage; there is one of them at a time. */
  actor(body: Body): Actor {
    const moves = retargeted(body, this.fit);
    const root = new THREE.Group().add(this.gltf.scene);
    root.scale.setScalar(this.fit.size);
    return actorOf(root, [clipOf(this.gltf, moves)]);
  }

  /** Its way in metres of its file, for a metre of the plain figure's. */
  get scale(): number {
    return this.fit.ratio / this.fit.size;
  }

  /**
   * The file with the motion as its only animation. `open`: for a page, small when deflated, without the numbers of its own
   * animations; an Error where its meshes are packed.
   */
  glb(body: Body, name: string, open = false): ArrayBuffer {
    if (open && this.content.extensionsRequired?.includes("EXT_meshopt_compression"))
      throw new Error(`${this.name} is packed with EXT_meshopt_compression, which a shared page cannot unpack`);
    const packing = new Packing(this.content, open ? withoutAnimations(this.content, this.binary) : this.binary);
    packing.animate(name, retargeted(body, this.fit), open ? GRAIN : 0);
    return packing.bytes();
  }
}

/** Where the bones of the file's skins were bound, in the space of the largest one. */
export function boundIn(gltf: GLTF): Map<number, Pose> {
  const skeletons: THREE.Skeleton[] = [];
  gltf.scene.traverse((one) => {
    const { skeleton } = one as THREE.SkinnedMesh;
    if (skeleton && !skeletons.includes(skeleton)) skeletons.push(skeleton);
  });
  skeletons.sort((a, b) => b.bones.length - a.bones.length);
  const found = new Map<number, Pose>();
  for (const { bones, boneInverses } of skeletons) {
    const own = bones.map((bone, n) => {
      const pose = poseOf(boneInverses[n]!.clone().invert().elements);
      return [gltf.parser.associations.get(bone)?.nodes ?? -1, pose] as const;
    });
    const shared = own.find(([n]) => found.has(n));
    if (found.size && !shared) continue;
    const space = shared ? hung(found.get(shared[0])!, unhung(shared[1], WORLD)) : WORLD;
    for (const [n, pose] of own) if (n >= 0 && !found.has(n)) found.set(n, hung(space, pose));
  }
  return found;
}

export function clipOf(gltf: GLTF, { fps, turns, places }: Moves): THREE.AnimationClip {
  const objects = new Map<number, THREE.Object3D>();
  gltf.scene.traverse((one) => {
    const n = gltf.parser.associations.get(one)?.nodes;
    if (n !== undefined && !objects.has(n)) objects.set(n, one);
  });
  const times = (count: number): number[] => Array.from({ length: count }, (_, f) => f / fps);
  const tracks: THREE.KeyframeTrack[] = [];
  for (const [n, own] of turns) {
    const values = own.flatMap(([w, x, y, z]) => [x, y, z, w]);
    if (objects.has(n))
      tracks.push(new THREE.QuaternionKeyframeTrack(`${objects.get(n)!.uuid}.quaternion`, times(own.length), values));
  }
  for (const [n, own] of places) {
    if (objects.has(n))
      tracks.push(new THREE.VectorKeyframeTrack(`${objects.get(n)!.uuid}.position`, times(own.length), own.flat()));
  }
  return new THREE.AnimationClip("motion", -1, tracks);
}
