/** Live mode: the keys, the stick and the floor steer somebody who moves without end; one key keeps all of it. */

import { motionClip } from "../body/clip";
import { type Bones, placesOf } from "../body/forward";
import { LiveClient, type LiveFrame, type LiveMessage } from "../server/live";
import { uploadMotion } from "../server/api";
import { type Ground } from "../project/path";
import type { App } from "./app";
import type { Deeds } from "./deeds";
import type { Drawer } from "./drawing";
import { Recording } from "./recording";
import { NOTHING } from "./session";

/** What the keys 1 to 8 say; 0 leaves the words to the steering. */
export const LIVE_WORDS = [
  "a person walks forward",
  "a person runs forward",
  "a person waves with one hand",
  "a person jumps up",
  "a person dances",
  "a person punches",
  "a person sits down",
  "a person raises both arms",
] as const;

const WALKING = 1.3;
const RUNNING = 3;
/** Degrees between two directions that are asked. */
const STEP = 10;
const DEAD = 0.25;
const HELD = ["w", "a", "s", "d", "q", "e", "shift"];

/** What the bar over the stage shows of it. */
export interface LiveState {
  readonly connected: boolean;
  readonly words: string;
  readonly seconds: number;
  readonly problem: string;
  /** Where somebody was sent on the floor. */
  readonly goal: Ground | null;
}

const UNWELCOME = "The server does not answer in live mode. Look at what it printed, and start it again.";

const BEGUN: LiveState = { connected: false, words: "", seconds: 0, problem: "", goal: null };

export class Live {
  private client: LiveClient | null = null;
  private bones: Bones | null = null;
  private recording = new Recording(20);
  private held = new Set<string>();
  private steered = "";
  private shown: { before: Float32Array; now: Float32Array; at: number } | null = null;

  /** `turn` turns the view by radians; `yaw` is where it looks, from +Z towards +X. */
  constructor(
    private readonly app: App,
    private readonly drawer: Drawer,
    private readonly deeds: Deeds,
    private readonly view: { turn(radians: number): void; yaw(): number },
  ) {}

  get isOn(): boolean {
    return this.client !== null;
  }

  toggle(): void {
    if (this.isOn) return this.leave();
    this.drawer.stop();
    this.app.session.update({ playing: false, tool: "select", sideBySide: false, fan: null, selection: NOTHING });
    this.app.live.value = BEGUN;
    this.recording = new Recording(20);
    this.client = new LiveClient({ seed: this.app.project.value.seed % 2 ** 31 }, (message) => this.take(message));
    requestAnimationFrame(() => this.tick());
  }

  /** Leave; what was not kept is gone. */
  leave(): void {
    this.client?.leave();
    this.client = null;
    this.shown = null;
    this.held.clear();
    this.steered = "";
    this.app.live.value = null;
    this.app.denoising.value = [];
    this.drawer.schedule();
  }

  /** Put all that was done onto the timeline. */
  async keep(): Promise<void> {
    const { recording } = this;
    if (recording.seconds < 0.5) return;
    this.leave();
    try {
      const result = await uploadMotion(new File([recording.file()], "live.json"));
      this.deeds.putRecording(result, recording.segments());
    } catch (error) {
      this.deeds.fail(error);
    }
  }

  say(text: string): void {
    this.client?.ask("say", { text });
  }

  /** Go to a place on the floor. */
  go({ x, z }: Ground): void {
    this.client?.ask("path", { points: [[x, z]] });
    this.change({ goal: { x, z } });
  }

  /** True: the key belongs to live mode. */
  press(event: KeyboardEvent): boolean {
    if (!this.isOn || event.ctrlKey || event.metaKey || event.altKey) return false;
    const key = event.key.toLowerCase();
    if (HELD.includes(key)) this.held.add(key);
    else if (/^[0-8]$/.test(key)) this.say(LIVE_WORDS[Number(key) - 1] ?? "");
    else if (key === "r") void this.keep();
    else if (key === "escape") this.leave();
    else if (key === "enter") document.querySelector<HTMLInputElement>("#live input")?.focus();
    else return false;
    return true;
  }

  release(event: KeyboardEvent): void {
    this.held.delete(event.key.toLowerCase());
  }

  /** No key is held any more, as where the window was left. */
  letGo(): void {
    this.held.clear();
  }

  private take(message: LiveMessage): void {
    switch (message.type) {
      case "welcome":
        if (this.recording.next !== null && this.recording.next !== message.frame) void this.aside();
        this.bones = message;
        this.change({ connected: true, problem: "" });
        return;
      case "frame":
        return this.frame(message);
      case "health":
        return this.change({ problem: message.problem });
      case "error":
        return this.change({ problem: message.message });
      case "closed":
        return this.change({ connected: false, problem: message.refused ? UNWELCOME : "" });
    }
  }

  private frame(frame: LiveFrame): void {
    if (!this.bones) return;
    this.recording.add(frame);
    const now = placesOf(this.bones, frame.root, frame.rotations);
    this.shown = { before: this.shown?.now ?? now, now, at: performance.now() };
    this.change({ words: frame.words, seconds: Math.round(this.recording.seconds * 10) / 10 });
  }

  /** The server was started anew and knows nothing of what was done: that becomes a clip, and a new one begins. */
  private async aside(): Promise<void> {
    const { recording } = this;
    this.recording = new Recording(recording.fps);
    this.shown = null;
    try {
      this.deeds.addClip(await uploadMotion(new File([recording.file()], "live.json")), "live");
    } catch (error) {
      this.deeds.fail(error);
    }
  }

  private change(part: Partial<LiveState>): void {
    const { value } = this.app.live;
    if (value) this.app.live.update(part);
  }

  /** Each picture: between two frames it is a mixture of them, a twentieth of a second late. */
  private tick(): void {
    if (!this.isOn) return;
    requestAnimationFrame(() => this.tick());
    this.steer();
    if (!this.shown) return;
    const { before, now, at } = this.shown;
    const part = Math.min(((performance.now() - at) / 1000) * this.recording.fps, 1);
    if (part === 1 && this.app.denoising.value[0]?.people[0] === now) return;
    const pose = part === 1 ? now : now.map((one, n) => before[n]! + (one - before[n]!) * part);
    this.app.denoising.value = [motionClip(this.recording.fps, [pose])];
  }

  /** Keys and stick as a direction seen from the camera; asked again only when it changes. */
  private steer(): void {
    const on = (key: string) => Number(this.held.has(key));
    if (on("q") !== on("e")) this.view.turn(0.03 * (on("q") - on("e")));
    let [x, z, fast] = [on("d") - on("a"), on("w") - on("s"), this.held.has("shift")];
    const pad = navigator.getGamepads?.().find((one) => one !== null);
    if (pad && Math.hypot(pad.axes[0]!, pad.axes[1]!) > DEAD) {
      [x, z] = [pad.axes[0]!, -pad.axes[1]!];
      fast = Boolean(pad.buttons[0]?.pressed) || Math.hypot(x, z) > 0.95;
    }
    const isGoing = Math.hypot(x, z) > 0.2;
    const degrees = ((this.view.yaw() - Math.atan2(x, z)) * 180) / Math.PI;
    const direction = Math.round(degrees / STEP) * STEP;
    const wanted = isGoing ? `${direction} ${fast}` : "";
    if (wanted === this.steered) return;
    this.client?.ask("steer", isGoing ? { direction, speed: fast ? RUNNING : WALKING } : {});
    if (isGoing) this.change({ goal: null });
    this.steered = wanted;
  }
}
