/** The user's own character: the motion as the server puts it on that character, played beside the playhead. */

import { type App, problemOf } from "../app/app";
import { keptTake } from "../project/model";
import { bytes, motionFile } from "../server/api";
import { type Actor, actorOf, setTime } from "./actor";
import { unpackedFile } from "./packed";
import type { Scene } from "./scene";

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
    setTime(this.actors, time, isShown);
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
    const name = this.app.project.value.character?.name ?? "the character";
    const gltf = await unpackedFile(await file.arrayBuffer(), name);
    return actorOf(gltf.scene, gltf.animations);
  }

  private leave(): void {
    for (const { root } of this.actors) this.scene.scene.remove(root);
    this.actors = [];
    delete this.scene.canvas.dataset.character;
    this.scene.invalidate();
  }
}
