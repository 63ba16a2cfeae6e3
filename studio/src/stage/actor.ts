/** Somebody out of a glTF file who plays animations of it; the file loads nothing from elsewhere. */

import * as THREE from "three";
import { type GLTF, GLTFLoader } from "three/addons/loaders/GLTFLoader.js";

/** What a character names outside of its own file is a white picture. */
const WHITE =
  "data:image/png;base64,iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAAAAAA6fptVAAAACklEQVR4nGP4DwABAQEAsTj2FAAAAABJRU5ErkJggg==";
export const inside = new THREE.LoadingManager();
inside.setURLModifier((url) => (/^(blob|data):/.test(url) ? url : WHITE));

export interface Actor {
  readonly root: THREE.Object3D;
  readonly mixer: THREE.AnimationMixer;
  readonly seconds: number;
}

export function parseGltf(data: ArrayBuffer): Promise<GLTF> {
  return new GLTFLoader(inside).parseAsync(data, "");
}

export function actorOf(root: THREE.Object3D, animations: readonly THREE.AnimationClip[]): Actor {
  const mixer = new THREE.AnimationMixer(root);
  for (const clip of animations) mixer.clipAction(clip).play();
  root.traverse((one) => {
    one.castShadow = one.receiveShadow = true;
    one.frustumCulled = false;
  });
  return { root, mixer, seconds: Math.max(...animations.map((one) => one.duration), 0.05) };
}

/** Everybody where they are at a time, or hidden. */
export function setTime(actors: readonly Actor[], time: number, isShown: boolean): void {
  for (const { root, mixer, seconds } of actors) {
    root.visible = isShown;
    if (isShown) mixer.setTime(Math.min(time, seconds - 1e-3));
  }
}
