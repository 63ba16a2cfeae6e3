/** The worker as the page uses it. */

import { Signal } from "../app/signal";
import { type MotionClip, motionClip } from "../body/clip";
import type { Body } from "../prior/person";
import type { Project } from "./link";
import type { About, Draw, WorkerMessage, Stop } from "./messages";

export interface Generated {
  readonly project: Project;
  readonly bodies: readonly Body[];
  readonly clips: readonly MotionClip[];
  /** For each take what it misses of the numbers in the words. */
  readonly misses: readonly (readonly string[])[];
}

export interface State {
  /** Null until the weights are there. */
  readonly about: About | null;
  readonly threads: number;
  /** Whether the graphics processor draws; why it does not though there is one. */
  readonly graphics: boolean;
  readonly remark: string;
  /** From 0 to 1; null: nothing is under way. */
  readonly progress: number | null;
  readonly says: string;
  readonly error: string;
  /** What is guessed while it is drawn. */
  readonly sketch: readonly MotionClip[];
  readonly drawn: Generated | null;
}

const FPS = 20;

export class Artist {
  readonly state = new Signal<State>({
    about: null,
    threads: 0,
    graphics: false,
    remark: "",
    progress: 0,
    says: "loading the weights",
    error: "",
    sketch: [],
    drawn: null,
  });
  private readonly worker = new Worker(new URL("./worker.ts", import.meta.url), { type: "module" });
  private asked: Project | null = null;
  private id = 0;

  constructor() {
    this.worker.onmessage = ({ data }: MessageEvent<WorkerMessage>) => this.receive(data);
    this.worker.onerror = () => this.fail("the part of the page that draws does not start; load the page again");
    this.worker.postMessage(document.baseURI.split("#")[0]);
  }

  /** Draw a project; what is being drawn is given up. */
  draw(project: Project): void {
    this.asked = project;
    this.id += 1;
    performance.mark("asked");
    if (this.state.value.about) this.state.update({ progress: 0, says: "drawing", error: "", sketch: [] });
    const { segments, literal, seed, takes, path } = project;
    this.worker.postMessage({ id: this.id, segments, literal, seed, takes, path } satisfies Draw);
  }

  /** Give up what is being drawn; what was drawn before is there again. */
  stop(): void {
    this.asked = null;
    this.id += 1;
    this.worker.postMessage({ stop: this.id } satisfies Stop);
    if (this.state.value.about) this.state.update({ progress: null, says: "stopped", sketch: [] });
  }

  private receive(message: WorkerMessage): void {
    if (message.kind === "loading") {
      const [done, of] = [message.done / 1e6, message.of / 1e6];
      this.state.update({
        progress: done / of,
        says: `loading the weights: ${done.toFixed(0)} of ${of.toFixed(0)} MB`,
      });
    } else if (message.kind === "ready") {
      const { about, threads, graphics, remark } = message;
      this.state.update({
        about,
        threads,
        graphics,
        remark,
        ...(this.asked ? { progress: 0, says: "drawing" } : { progress: null, says: "" }),
      });
    } else if (message.id !== null && message.id !== this.id) return;
    else if (message.kind === "failed") this.fail(message.message);
    else if (message.kind === "sketch") {
      const sketch = message.takes.map((places) => motionClip(FPS, [places]));
      if (sketch.length && !this.state.value.sketch.length) performance.mark("preview");
      this.state.update({ progress: message.done / message.of, ...(sketch.length ? { sketch } : {}) });
    } else {
      const clips = message.takes.map((places) => motionClip(FPS, [places]));
      performance.mark("drawn");
      const project = { ...this.asked!, weights: this.state.value.about!.weights };
      this.state.update({
        progress: null,
        says: "",
        sketch: [],
        drawn: { project, bodies: message.bodies, clips, misses: message.misses },
      });
    }
  }

  private fail(message: string): void {
    this.state.update({ progress: null, says: "", sketch: [], error: message });
  }
}
