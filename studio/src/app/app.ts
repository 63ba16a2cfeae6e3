/** What every part of the page is given: the project with its history, what is shown, and what the server said. */

import type { MotionClip } from "../body/clip";
import { ProjectError } from "../project/file";
import type { History } from "../project/history";
import { type Project, length } from "../project/model";
import { type Problem, placeOf, withoutKeys } from "../project/places";
import { FULL, Refused, Unreachable } from "../server/http";
import type { LiveState } from "./live";
import type { Session } from "./session";
import type { Signal } from "./signal";

export interface App {
  readonly project: History<Project>;
  readonly session: Signal<Session>;
  /** The takes while they are denoised, as far as they were sent; empty: nothing is being drawn, or nothing was sent. */
  readonly denoising: Signal<readonly MotionClip[]>;
  /** Live mode; null: it is off. What is done then is shown as what is denoised is. */
  readonly live: Signal<LiveState | null>;
}

/** The motion that is on the stage. */
export function shownClip(app: App): MotionClip | null {
  const { clips } = app.session.value;
  return clips[app.project.value.kept] ?? clips[0] ?? null;
}

/** What is seen of the kept take while it is denoised. */
export function denoised(app: App): MotionClip | null {
  const { value } = app.denoising;
  return value[app.project.value.kept] ?? value[0] ?? null;
}

/** The takes that are seen beside each other: while they are drawn each as far as it is, before that the old ones. */
export function seenTakes(app: App): readonly MotionClip[] {
  const { clips } = app.session.value;
  const drawn = app.denoising.value;
  return [...drawn, ...clips.slice(drawn.length)];
}

/** An error as a sentence with its place in the project. */
export function problemOf(app: App, error: unknown): Problem {
  if (isFault(error)) return { message: faultOf(error), at: null };
  const { message } = error as Error;
  if (!(error instanceof Refused)) return { message, at: null };
  const at = placeOf(app.project.value, message, error.where);
  return { message: withoutKeys(message), at, isFull: error.status === FULL };
}

/** Whether an error is the program's or the browser's own rather than a sentence that was written for somebody. */
function isFault(error: unknown): boolean {
  const isSaid = error instanceof Refused || error instanceof Unreachable || error instanceof ProjectError;
  return !isSaid && (error as Error | null)?.constructor !== Error;
}

/** A fault as a sentence. */
export function faultOf(error: unknown): string {
  const what = error instanceof Error ? `${error.name}: ${error.message}` : String(error);
  return `That failed by a fault of this page (${what.slice(0, 160)}); your work is kept, and a reload may help.`;
}

/** Show what went wrong: nobody answers, there is no room, or a sentence at its place; `what` begins it. */
export function fail(app: App, error: unknown, what = ""): void {
  if (error instanceof Unreachable) return app.session.update({ connected: false });
  const problem = problemOf(app, error);
  const message = !what || problem.message.startsWith(what) ? problem.message : `${what}: ${problem.message}`;
  app.session.update({ error: { ...problem, message } });
}

/** Seconds that the playhead may go to. */
export function duration(app: App): number {
  const clip = shownClip(app);
  const fan = app.session.value.fan?.clips[0]?.seconds ?? 0;
  return Math.max(length(app.project.value), clip?.seconds ?? 0, fan);
}
