/** What stands in the file: motions as whole numbers, and the character that plays them, read into takes. */

import { clone } from "three/addons/utils/SkeletonUtils.js";
import * as THREE from "three";
import type { GLTF } from "three/addons/loaders/GLTFLoader.js";
import { type MotionClip, POSE, motionClip } from "../body/clip";
import { JOINTS } from "../body/skeleton";
import { type Actor, actorOf, parseGltf, setTime } from "../stage/actor";

/** Frames a second of a file that does not say any, and frames that are looked at at most. */
const RATE = 30;
const MOST = 20_000;

/** As `motionloom/viz/page.py` writes it. */
export interface MotionJson {
  readonly takes: readonly GivenTake[];
  /** Metres of which places are whole numbers. */
  readonly unit: number;
  /** Base64 of a deflated .glb whose animations are those of everybody, take after take; null: mannequins play. */
  readonly character: string | null;
}

export interface GivenTake {
  readonly name: string;
  readonly fps: number;
  readonly people: readonly GivenPerson[];
}

export interface GivenPerson {
  readonly frames: number;
  /** Base64 of deflated bytes: see `placesOf`. */
  readonly data: string;
}

export interface Take {
  readonly name: string;
  /** Null: a file without the 22 joints, of which nothing is known but what its actors show. */
  readonly clip: MotionClip | null;
  readonly seconds: number;
  /** None: mannequins. */
  readonly actors: readonly Actor[];
}

export async function takesOf(given: MotionJson): Promise<Take[]> {
  const file = given.character === null ? null : await parseGltf(await inflated(given.character));
  const read = given.takes.map(async ({ fps, people }) =>
    motionClip(fps, await Promise.all(people.map((one) => placesOf(one, given.unit)))),
  );
  let number = 0;
  return (await Promise.all(read)).map((clip, index) => {
    const actors = file ? clip.people.map(() => actorOf(clone(file.scene), [file.animations[number++]!])) : [];
    return { name: given.takes[index]!.name, clip, seconds: clip.seconds, actors };
  });
}

/** A take for each animation of a glTF file, in which everybody moves; of the first person the joints are known. */
export function takesOfFile(file: GLTF): Take[] {
  return file.animations.map((animation) => {
    const actor = actorOf(clone(file.scene), [animation]);
    const joints = JOINTS.map((name) => actor.root.getObjectByName(name));
    const isPerson = joints.every((joint) => joint !== undefined);
    const clip = isPerson ? sampled(actor, joints, Number(animation.userData.fps) || RATE) : null;
    return { name: animation.name, clip, seconds: clip?.seconds ?? actor.seconds, actors: [actor] };
  });
}

/** Where joints are at so many frames a second. */
function sampled(actor: Actor, joints: readonly THREE.Object3D[], fps: number): MotionClip {
  const frames = Math.min(Math.round(actor.seconds * fps) + 1, MOST);
  const places = new Float32Array(frames * POSE);
  for (let frame = 0; frame < frames; frame += 1) {
    setTime([actor], frame / fps, true);
    actor.root.updateMatrixWorld(true);
    joints.forEach((joint, n) =>
      new THREE.Vector3().setFromMatrixPosition(joint.matrixWorld).toArray(places, frame * POSE + n * 3),
    );
  }
  return motionClip(fps, [places]);
}

/**
 * Places (frames * 22 * 3). What is deflated are 32-bit whole numbers, all lowest bytes first: for each coordinate of
 * each joint the changes from frame to frame, of the root's places and of the others' seen from it.
 */
export async function placesOf({ frames, data }: GivenPerson, unit: number): Promise<Float32Array> {
  const bytes = new Uint8Array(await inflated(data));
  const count = frames * POSE;
  if (bytes.length !== count * 4) throw new Error("its numbers are not whole");
  const places = new Float32Array(count);
  for (let column = 0; column < POSE; column += 1) {
    let whole = 0;
    for (let frame = 0; frame < frames; frame += 1) {
      const at = column * frames + frame;
      whole += bytes[at]! | (bytes[at + count]! << 8) | (bytes[at + 2 * count]! << 16) | (bytes[at + 3 * count]! << 24);
      places[frame * POSE + column] = whole * unit + (column < 3 ? 0 : places[frame * POSE + (column % 3)]!);
    }
  }
  return places;
}

/** What base64 of deflated bytes was. */
function inflated(base64: string): Promise<ArrayBuffer> {
  const bytes = Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0));
  return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"))).arrayBuffer();
}
