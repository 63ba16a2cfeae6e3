/** Motions on characters of three.js. */

import type { AnimationClip } from "three";
import type { GLTF } from "three/addons/loaders/GLTFLoader.js";
import type { Turn, Vec } from "../../../src/prior/turns";
import { boundIn, clipOf } from "../../../src/tab/character";
import type { Content } from "../../../src/tab/glbFile";
import { fitOf, retargeted } from "../../../src/tab/retarget";
import { rigOf } from "../../../src/tab/rig";
import { JOINTS, type Motion } from "./index";

/**
 * A motion as an animation of a character: `new AnimationMixer(gltf.scene).clipAction(clipFor(gltf, motion)).play()`.
 *
 * gltf: what GLTFLoader gave for a .glb or .vrm, with nothing moved in it yet: upright at rest, its arms out or down,
 * bones known by a VRM's list or by names as Mixamo, Unreal, Blender and others have them. The clip is in the file's
 * own size, moves `gltf.scene` and no copy of it, and keeps planted feet where the person's are. Raises an Error that
 * says why nobody can move in the file.
 */
export function clipFor(gltf: GLTF, motion: Motion): AnimationClip {
  const { fps, frames, root, rotations } = motion;
  const rows = <T>(from: Float32Array, count: number, width: number, at: number): T[] =>
    Array.from({ length: count }, (_, n) => [...from.subarray(at + n * width, at + (n + 1) * width)] as T);
  const turns = Array.from({ length: frames }, (_, n) =>
    rows<Turn>(rotations, JOINTS.length, 4, n * 4 * JOINTS.length),
  );
  const fit = fitOf(rigOf(gltf.parser.json as Content, boundIn(gltf)));
  return clipOf(gltf, retargeted({ fps, root: rows<Vec>(root, frames, 3, 0), turns }, fit));
}
