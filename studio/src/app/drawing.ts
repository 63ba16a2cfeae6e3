/** Draws again on its own: whatever changes what is asked makes a new motion, a quick one first. */

import { keepWay, needsWay } from "../project/asks";
import { type Project, keptTake } from "../project/model";
import { type Job, type Plan, plan, planKey } from "../project/plan";
import { type JobRequest, type Result, motion, takeOf } from "../server/api";
import { Refused } from "../server/http";
import { type Watcher, isAway, runJob } from "../server/jobs";
import { type App, problemOf, shownClip } from "./app";

/** Network calls of a preview; the full draw takes the server's own number. */
const PREVIEW_STEPS = 6;
/** Milliseconds that somebody pauses in typing before their words are drawn. */
const TYPING = 550;

/** When the last draws were asked and seen, for scripts that measure (`performance` marks). */
export const MARKS = { asked: "draw-asked", preview: "draw-preview", full: "draw-full" } as const;

export class Drawer {
  private running: AbortController | null = null;
  private key = "";
  private timer = 0;

  constructor(private readonly app: App) {
    app.project.subscribe((_, change) => {
      if (change.draft) return;
      this.loadTakes();
      if (change.label) this.schedule(change.typed ? TYPING : 0);
    });
  }

  /** Bring the motion up to the project, after `delay` milliseconds. */
  schedule(delay = 0): void {
    clearTimeout(this.timer);
    this.keepWays();
    const { value } = this.app.project;
    const { jobs, missing } = plan(value);
    const key = planKey(value);
    if (key === value.drawn || !jobs.length) {
      this.stop();
      this.app.session.update({ error: missing, pending: false });
      return;
    }
    if (key === this.key && this.running) return this.app.session.update({ pending: false });
    performance.mark(MARKS.asked);
    this.app.session.update({ pending: true });
    this.timer = window.setTimeout(() => void this.draw(), delay);
  }

  /** Joints that are asked over several blocks need a path: the way as it is. */
  private keepWays(): void {
    const clip = shownClip(this.app);
    const who = needsWay(this.app.project.value);
    if (clip && who >= 0 && who < clip.people.length) this.app.project.amend((old) => keepWay(old, who, clip));
  }

  /** Draw with another seed. */
  again(): void {
    this.app.session.update({ error: null });
    this.app.project.change("draw again", (old) => ({ ...old, seed: old.seed + old.count }));
  }

  stop(): void {
    this.running?.abort();
    this.running = null;
    this.key = "";
    this.app.denoising.value = null;
    this.app.session.update({ drawing: null });
  }

  /** Run one job beside the timeline, such as a prediction; null where it failed, which is then said. */
  async once(job: JobRequest): Promise<readonly Result[] | null> {
    this.stop();
    const running = (this.running = new AbortController());
    this.app.session.update({ error: null, drawing: { done: 0, of: 1, preview: false } });
    try {
      return await runJob(job, running.signal, this.watcher(running, false));
    } catch (error) {
      this.say(error, running);
      return null;
    } finally {
      if (this.running === running) this.stop();
    }
  }

  private async draw(): Promise<void> {
    const { value } = this.app.project;
    const { jobs }: Plan = plan(value);
    this.stop();
    const running = (this.running = new AbortController());
    this.key = planKey(value);
    const drawing = { done: 0, of: 1, preview: true };
    this.app.session.update({ error: null, fan: null, pending: false, drawing });
    try {
      const shown = await this.preview(jobs, running);
      // The full draw is asked for while the preview is on its way to the stage.
      const [results] = await Promise.all([this.chain(jobs, running), shown()]);
      await this.keep(value, this.key, results, running.signal);
      performance.mark(MARKS.full);
    } catch (error) {
      this.say(error, running);
    } finally {
      if (this.running === running) this.stop();
    }
  }

  /** Draw quickly; gives what fetches the motion and puts it on the stage. */
  private async preview(jobs: readonly Job[], running: AbortController): Promise<() => Promise<void>> {
    const [job] = jobs;
    if (!job || jobs.length > 1) return () => Promise.resolve();
    // A quick draw is too short to be watched, and it would hide the motion that is there.
    const levels = !this.app.session.value.clips.length;
    const asked = { ...job, count: 1, steps: PREVIEW_STEPS, levels };
    const [result] = await runJob(asked, running.signal, this.watcher(running, true));
    return async () => {
      if (!result) return;
      const clip = await motion(result.id);
      if (running.signal.aborted || this.running !== running) return;
      this.app.denoising.value = null;
      this.app.session.update({ clips: [clip] });
      performance.mark(MARKS.preview);
    };
  }

  /** Jobs one after the other; an edit without a motion goes on from the one before. */
  private async chain(jobs: readonly Job[], running: AbortController): Promise<readonly Result[]> {
    let results: readonly Result[] = [];
    for (const job of jobs) {
      const request = job.task === "edit" && !job.motion ? { ...job, motion: results[0]!.id } : job;
      results = await runJob(request, running.signal, this.watcher(running, false));
    }
    return results;
  }

  private async keep(project: Project, key: string, results: readonly Result[], signal: AbortSignal): Promise<void> {
    const takes = results.map((result) => takeOf(result, project.base ? "redrawn" : "drawn"));
    const clips = await Promise.all(takes.map((take) => motion(take.motion)));
    signal.throwIfAborted();
    this.app.denoising.value = null;
    this.app.project.amend((now) => {
      const kept = now.kept < takes.length ? now.kept : 0;
      return planKey(now) === key ? { ...now, takes, kept, drawn: key } : now;
    });
    this.app.session.update({ clips });
  }

  private watcher(running: AbortController, preview: boolean): Watcher {
    const isCurrent = () => this.running === running && !running.signal.aborted;
    return {
      progress: (done, of) => isCurrent() && this.app.session.update({ drawing: { done, of, preview } }),
      level: ({ clip, row }) => {
        if (isCurrent() && row === 0) this.app.denoising.value = clip;
      },
    };
  }

  private say(error: unknown, running: AbortController): void {
    if (running.signal.aborted && this.running !== running) return;
    if (error instanceof DOMException && error.name === "AbortError") return;
    if (isAway(error)) this.app.session.update({ connected: false });
    else this.app.session.update({ error: problemOf(this.app, error) });
  }

  /** The clips of the project's takes, after undo for instance. */
  loadTakes(): void {
    const { takes } = this.app.project.value;
    const ids = takes.map((take) => take.motion).join();
    if (!takes.length) return;
    Promise.all(takes.map((take) => motion(take.motion)))
      .then((clips) => {
        const now = this.app.project.value.takes.map((take) => take.motion).join();
        const shown = this.app.session.value.clips;
        const same = clips.length === shown.length && clips.every((clip, index) => clip === shown[index]);
        if (now === ids && !same && !this.running) this.app.session.update({ clips });
      })
      .catch((error: unknown) => this.lost(error, ids));
  }

  /** Motions that the server no longer has are drawn anew. */
  private lost(error: unknown, ids: string): void {
    if (isAway(error)) return this.app.session.update({ connected: false });
    if (!(error instanceof Refused) || error.status !== 404)
      return this.app.session.update({ error: problemOf(this.app, error) });
    const { value } = this.app.project;
    if (value.takes.map((take) => take.motion).join() !== ids) return;
    const isBased = keptTake(value)?.motion === value.base?.motion;
    this.app.project.amend((old) => ({
      ...old,
      takes: [],
      kept: 0,
      drawn: "",
      ...(isBased ? { base: null, frozen: [] } : {}),
    }));
    this.schedule();
  }
}
