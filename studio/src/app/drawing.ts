/** Draws again on its own: whatever changes what is asked makes a new motion, which is shown as it takes shape. */

import { pathFromMotion, personWithoutPath } from "../project/constraints";
import { overlaid } from "../body/clip";
import { CHANGED, FPS, type Project, keptTake, length } from "../project/model";
import { type Job, type Plan, isUpToDate, plan, planKey } from "../project/plan";
import { trackKeys } from "../project/tracks";
import { type Result, motion, takeOf } from "../server/api";
import type { JobRequest } from "../server/types";
import { Refused } from "../server/http";
import { type Level, runJob } from "../server/jobs";
import { type App, denoised, fail, shownClip } from "./app";

/**
 * Where a motion is there already, what is predicted for the new one is shown after every so many network calls: from
 * the first quarter of them on it is as near to the full motion as a draw of a quarter of the steps.
 */
const SHOWN_EVERY = 6;
const PREVIEW = 0.25;
/** Milliseconds that somebody pauses in typing before their words are drawn. */
const TYPING = 250;

/** Milliseconds between two states of the progress bar: each is a new picture of the page. */
const TELLING = 150;

/** Milliseconds of a picture beyond which only the preview is shown: without a GPU pictures are drawn by processors. */
const SLOW = 45;

/** When the last draws were asked and seen, for scripts that measure (`performance` marks). */
export const MARKS = { asked: "draw-asked", preview: "draw-preview", full: "draw-full" } as const;

/** The motion whose blocks stay where they ask for the same; null: none, or there are to be several. */
function keptFrom(project: Project): string | null {
  return project.count === 1 && !project.base ? (keptTake(project)?.under ?? keptTake(project)?.motion ?? null) : null;
}

/** Where nothing is drawn over what is frozen, that is the take. */
function asFrozen(project: Project): Project {
  const { base } = project;
  return base && keptTake(project)?.motion !== base.motion
    ? { ...project, takes: [base], kept: 0, drawn: "[]" }
    : project;
}

export class Drawer {
  private running: AbortController | null = null;
  private key = "";
  private timer = 0;
  /** The takes whose preview was shown. */
  private previewed = new Set<number>();
  private isSlow = false;

  constructor(private readonly app: App) {
    app.project.subscribe((_, change) => {
      if (change.draft) return;
      if (change.elsewhere) this.yield();
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
      if (!missing && value.base && key !== value.drawn) this.app.project.amend(asFrozen);
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
    const who = personWithoutPath(this.app.project.value);
    if (clip && who >= 0 && who < clip.people.length) this.app.project.amend((old) => pathFromMotion(old, who, clip));
  }

  /** Draw all blocks, also those that would be kept: what the timeline's file makes. */
  all(): void {
    this.app.project.change("draw all blocks", (old) => ({ ...old, takes: [], kept: 0, drawn: "" }));
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
    this.app.denoising.value = [];
    this.app.session.update({ drawing: null });
  }

  /** Give up a draw that another page has done, or whose words are no more; what was asked beside the timeline goes on. */
  private yield(): void {
    const { value } = this.app.project;
    if (this.key && (isUpToDate(value) || planKey(value) !== this.key)) this.stop();
  }

  /** Until nothing is being drawn any more, nor about to be: what is done with the take then is done with the new one. */
  finished(): Promise<void> {
    const { session } = this.app;
    const isIdle = () => session.value.drawing === null && !session.value.pending;
    return new Promise((resolve) => {
      if (isIdle()) return resolve();
      const leave = session.subscribe(() => {
        if (!isIdle()) return;
        leave();
        resolve();
      });
    });
  }

  /** Run one job beside the timeline, such as a prediction; null where it failed, which is then said. */
  async once(job: JobRequest): Promise<readonly Result[] | null> {
    await this.finished();
    this.running?.abort();
    const running = (this.running = new AbortController());
    this.previewed.clear();
    this.app.session.update({ error: null, drawing: { done: 0, of: 1 } });
    try {
      return await this.run(job, running);
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
    // What was predicted for a draw that is given up stays on the stage until there is something of this one.
    this.running?.abort();
    const running = (this.running = new AbortController());
    this.key = planKey(value);
    this.previewed.clear();
    if (value.base) this.app.denoising.value = [];
    this.app.session.update({ error: null, fan: null, pending: false, drawing: { done: 0, of: 1 } });
    try {
      const results = await this.chain(jobs, running, keptFrom(value));
      await this.keep(value, this.key, results, running.signal);
      performance.mark(MARKS.full);
    } catch (error) {
      this.say(error, running);
    } finally {
      if (this.running === running) this.stop();
    }
  }

  /**
   * Jobs one after the other; an edit without a motion goes on from the one before. `old`: the motion of which a timeline
   * keeps what did not change, as long as the server has it.
   */
  private async chain(jobs: readonly Job[], running: AbortController, old: string | null): Promise<readonly Result[]> {
    let results: readonly Result[] = [];
    for (const job of jobs) {
      if (job.task === "edit" && !job.motion) results = await this.edited(job, results, running);
      else if (job.task !== "compose" || !old) results = await this.run(job as JobRequest, running, job.count);
      else
        results = await this.run({ ...job, kept_from: old }, running, job.count).catch((error: unknown) => {
          if (!(error instanceof Refused) || error.status !== 404) throw error;
          return this.run(job, running, job.count);
        });
    }
    return results;
  }

  /** Every motion changed by an edit; what was remarked on it stays. */
  private async edited(job: Job, before: readonly Result[], running: AbortController): Promise<readonly Result[]> {
    const found: Result[] = [];
    for (const [row, old] of before.entries()) {
      const request = { ...job, motion: old.id, seed: (job.seed ?? 0) + row } as JobRequest;
      const made = await this.run(request, running, before.length > 1 ? before.length : job.count, row);
      found.push(
        ...made.map((one) => ({
          ...one,
          under: old.under ?? old.id,
          measures: { ...old.measures, ...one.measures },
          remarks: [...new Set([...(old.remarks ?? []), ...(one.remarks ?? [])])],
          notes: [...(old.notes ?? []), ...(one.notes ?? [])],
        })),
      );
    }
    return found;
  }

  private async keep(project: Project, key: string, results: readonly Result[], signal: AbortSignal): Promise<void> {
    const how = ({ measures }: Result) => {
      if (project.base) return "redrawn";
      if (!measures?.redrawn) return "drawn";
      return measures.redrawn.length ? CHANGED : (keptTake(project)?.how ?? CHANGED);
    };
    const tracks = trackKeys(project);
    const takes = results.map((result) => ({
      ...takeOf(result, how(result)),
      ...(tracks.length ? { tracks } : {}),
      ...(result.under && !project.base ? { under: result.under } : {}),
    }));
    const clips = await Promise.all(takes.map((take) => motion(take.motion)));
    signal.throwIfAborted();
    this.app.denoising.value = [];
    this.app.project.amend((now) => {
      const kept = now.kept < takes.length ? now.kept : 0;
      // What another page has drawn meanwhile is the same.
      return planKey(now) === key && now.drawn !== key ? { ...now, takes, kept, drawn: key } : now;
    });
    const { value } = this.app.project;
    if (value.takes === takes || value.drawn !== key) this.app.session.update({ clips });
  }

  /** Run one job and show how it comes along: its motions are the takes from the `first` on, of so many. */
  private run(job: JobRequest, running: AbortController, takes = 1, first = 0): Promise<readonly Result[]> {
    const isCurrent = () => this.running === running && !running.signal.aborted;
    // The first motion is seen as it comes out of the noise; a later one would hide the motion that is there.
    const levels = this.app.session.value.clips.length ? SHOWN_EVERY : true;
    let told = 0;
    return runJob({ levels, ...job }, running.signal, {
      progress: (done, of) => {
        if (!isCurrent() || performance.now() - told < TELLING) return;
        told = performance.now();
        this.app.session.update({ drawing: { done, of } });
      },
      level: (level) => {
        const row = level.row + first;
        if (isCurrent() && row < takes) this.show(job, { ...level, row }, takes);
      },
    });
  }

  /** Put what is predicted for the motion on the stage; a part lies in the motion that it changes. */
  private show(job: JobRequest, { level, of, row, clip, begin }: Level, takes: number): void {
    if (this.previewed.has(row) && this.isSlow) return;
    const { denoising } = this.app;
    const shown = denoising.value.slice(0, takes);
    if (row > shown.length) return;
    const isPart =
      job.task === "edit" ||
      (job.task === "compose" && job.kept_from && clip.seconds < length(this.app.project.value) - 0.5 / FPS);
    const whole = isPart ? (shown[row] ?? denoised(this.app) ?? shownClip(this.app)) : null;
    shown[row] = whole ? overlaid(whole, clip, job.task === "edit" ? (job.person ?? 0) : 0, begin) : clip;
    denoising.value = shown;
    if (this.previewed.has(row) || level / of < PREVIEW) return;
    this.previewed.add(row);
    if (this.previewed.size > 1) return;
    performance.mark(MARKS.preview);
    const begun = performance.now();
    requestAnimationFrame(() => requestAnimationFrame(() => (this.isSlow = performance.now() - begun > SLOW)));
  }

  private say(error: unknown, running: AbortController): void {
    if (running.signal.aborted && this.running !== running) return;
    if (error instanceof DOMException && error.name === "AbortError") return;
    fail(this.app, error);
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
    if (!(error instanceof Refused) || error.status !== 404) return fail(this.app, error);
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
