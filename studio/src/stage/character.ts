/** The user's own character: the motion as the server puts it on that character, played beside the playhead. */

import * as THREE from "three";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import { type App, problemOf } from "../app/app";
import { keptTake } from "../project/model";
import { bytes, motionFile } from "../server/api";
import type { Scene } from "./scene";

/** A character loads nothing from elsewhere: a picture that it names outside of its own file is a white one. */
const WHITE =
  "data:image/png;base64,iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAAAAAA6fptVAAAACklEQVR4nGP4DwABAQEAsTj2FAAAAABJRU5ErkJggg==";
const inside = new THREE.LoadingManager();
inside.setURLModifier((url) => (/^(blob|data):/.test(url) ? url : WHITE));

interface Actor {
  readonly root: THREE.Object3D;
  readonly mixer: THREE.AnimationMixer;
  readonly seconds: number;
}

export class Character {
  private key = "";
  private actors: readonly Actor[] = [];

  constructor(
    private readonly app: App,
    private readonly scene: Scene,
  ) {}

  /** Fetch what the project says, if it is not here. */
  update(): void {
    const { character } = this.app.project.value;
    const take = keptTake(this.app.project.value);
    const key = character && take ? `${character.id}/${take.motion}` : "";
    if (key === this.key) return;
    this.key = key;
    this.leave();
    if (character && take) void this.load(key, take.motion, character.id, take.people);
  }

  /** Put the character where it is at a time, or hide it; false: it is not to be seen. */
  at(time: number, isShown: boolean): boolean {
    for (const { root, mixer, seconds } of this.actors) {
      root.visible = isShown;
      if (isShown) mixer.setTime(Math.min(time, seconds - 1e-3));
    }
    return isShown && this.actors.length > 0;
  }

  private async load(key: string, motion: string, character: string, people: number): Promise<void> {
    try {
      const numbers = Array.from({ length: people }, (_, person) => person);
      const actors = await Promise.all(
        numbers.map((person) => this.actor(motion, character, people > 1 ? person : undefined)),
      );
      if (key !== this.key) return;
      this.actors = actors;
      this.scene.canvas.dataset.character = character;
      this.scene.scene.add(...actors.map((one) => one.root));
      this.app.session.update({ clips: [...this.app.session.value.clips] });
    } catch (error) {
      if (key === this.key) this.app.session.update({ error: problemOf(this.app, error) });
    }
  }

  private async actor(motion: string, character: string, person: number | undefined): Promise<Actor> {
    const file = await bytes(motionFile(motion, "glb", { skeleton: character, person }));
    const gltf = await new GLTFLoader(inside).parseAsync(await file.arrayBuffer(), "");
    const mixer = new THREE.AnimationMixer(gltf.scene);
    for (const clip of gltf.animations) mixer.clipAction(clip).play();
    gltf.scene.traverse((one) => {
      one.castShadow = one.receiveShadow = true;
      one.frustumCulled = false;
    });
    return { root: gltf.scene, mixer, seconds: Math.max(...gltf.animations.map((one) => one.duration), 0.05) };
  }

  private leave(): void {
    for (const { root } of this.actors) this.scene.scene.remove(root);
    this.actors = [];
    delete this.scene.canvas.dataset.character;
    this.scene.invalidate();
  }
}
