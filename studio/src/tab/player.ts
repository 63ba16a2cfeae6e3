/** The stage and the bar below it: who is shown when. */

import { h, morph } from "../app/dom";
import { Signal } from "../app/signal";
import type { Place } from "../prior/path";
import { type MotionClip, jointAt } from "../body/clip";
import { icon } from "../panels/icons";
import type { Body } from "../prior/person";
import { type Actor, setTime } from "../stage/actor";
import { Cast } from "../stage/cast";
import { Scene } from "../stage/scene";
import { DARK, GHOSTS, LIGHT } from "../stage/theme";
import type { Character } from "./character";
import { FloorPath } from "./floor";

/** Milliseconds between pictures while processors have to draw them and the next motion too. */
const BEAT = 150;

export class Player {
  /** Number of the take that is shown. */
  readonly take = new Signal(0);
  /** Whether the other takes are shown too. */
  readonly compare = new Signal(false);
  readonly floor: FloorPath;
  private readonly scene: Scene;
  private readonly cast: Cast;
  private clips: readonly MotionClip[] = [];
  private bodies: readonly Body[] = [];
  private character: Character | null = null;
  /** The character as it does what `acted` does. */
  private actor: Actor | null = null;
  private acted: Body | null = null;
  private time = 0;
  private playing = true;
  /** Whether the next motion is being drawn, which needs the processors. */
  working = false;
  private waited = 0;
  /** Whether what is shown is a guess that changes. */
  private rough = false;

  constructor(
    canvas: HTMLCanvasElement,
    private readonly bar: HTMLElement,
    dark: boolean,
    drawnPath: (points: readonly Place[] | null) => void,
  ) {
    const theme = dark ? DARK : LIGHT;
    this.scene = new Scene(canvas, theme);
    this.cast = new Cast(this.scene.scene, theme);
    this.floor = new FloorPath(this.scene, theme, drawnPath);
    this.scene.busy = () => this.rough || this.working;
    this.scene.step = (elapsed) => this.step(elapsed);
    this.take.subscribe(() => this.place());
    this.compare.subscribe(() => this.place());
    addEventListener("keydown", (event) => {
      const typing = event.target instanceof HTMLElement && event.target.matches("input, textarea, button, a");
      if (event.key !== " " || typing) return;
      event.preventDefault();
      this.toggle();
    });
    this.place();
  }

  /** `bodies`: of the same takes; none while they are guessed. */
  show(clips: readonly MotionClip[], bodies: readonly Body[] = []): void {
    const rough = clips.length > 0 && !bodies.length;
    if (!this.rough && rough) this.time = 0;
    [this.clips, this.bodies, this.rough] = [clips, bodies, rough];
    this.place();
  }

  /** Who is moved; null: the plain figure. */
  play(character: Character | null): void {
    this.leave();
    this.character = character;
    this.place();
  }

  look(dark: boolean): void {
    const theme = dark ? DARK : LIGHT;
    this.scene.look(theme);
    this.cast.look(theme);
    this.floor.look(theme);
    this.place();
  }

  private get clip(): MotionClip | null {
    return this.clips[this.take.value] ?? this.clips[0] ?? null;
  }

  private toggle(): void {
    this.playing = !this.playing;
    this.place();
  }

  private step(since: number): boolean {
    const { clip } = this;
    if (!clip || this.floor.active) return false;
    this.waited += since;
    if (this.working && this.scene.software && this.waited < BEAT) return false;
    const elapsed = this.waited;
    this.waited = 0;
    if (this.playing) {
      this.time = (this.time + elapsed / 1000) % clip.seconds;
      this.place();
    }
    const [x, , z] = jointAt(clip, 0, 0, this.time);
    const before = this.scene.orbit.target.clone();
    this.scene.centre(x, z, true, 1 - Math.exp(-elapsed / 220));
    return this.playing || before.distanceToSquared(this.scene.orbit.target) > 1e-7;
  }

  /** The character, moved as the shown take is; null: nobody. */
  private acting(): Actor | null {
    const body = this.bodies[this.take.value] ?? this.bodies[0] ?? null;
    if (body === this.acted && this.actor) return this.actor;
    this.leave();
    if (!this.character || !body) return null;
    [this.actor, this.acted] = [this.character.actor(body), body];
    this.scene.scene.add(this.actor.root);
    this.scene.canvas.dataset.character = this.character.name;
    return this.actor;
  }

  private leave(): void {
    if (this.actor) this.scene.scene.remove(this.actor.root);
    [this.actor, this.acted] = [null, null];
    delete this.scene.canvas.dataset.character;
  }

  private place(): void {
    const { clip, time } = this;
    const actor = this.acting();
    this.cast.show(clip, time, actor !== null);
    if (actor) setTime([actor], time, true);
    const others = this.compare.value ? this.clips.filter((one) => one !== clip) : [];
    this.cast.showGhosts(
      others.map((one, n) => ({ clip: one, color: GHOSTS[n]! })),
      time,
    );
    this.scene.invalidate();
    const label = this.playing ? "Pause" : "Play";
    const seek = (event: Event): void => {
      [this.time, this.playing] = [Number((event.target as HTMLInputElement).value), false];
      this.place();
    };
    const last = clip ? clip.seconds : 0;
    const button = {
      class: "icon",
      "aria-label": label,
      title: `${label} (space)`,
      disabled: !clip,
      onclick: () => this.toggle(),
    };
    const range = { type: "range", min: 0, max: last, step: 0.05, value: time.toFixed(2), disabled: !clip };
    morph(this.bar, [
      h("button", button, icon(this.playing ? "pause" : "play")),
      h("input", { ...range, "aria-label": "Time, seconds", oninput: seek }),
      h("span", { class: "clock" }, `${time.toFixed(1)} / ${last.toFixed(1)} s`),
    ]);
  }
}
