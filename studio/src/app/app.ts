/** What every part of the page is given: the project with its history, what is shown, and what the server said. */

import type { MotionClip } from "../body/clip";
import type { History } from "../project/history";
import { type Project, length } from "../project/model";
import type { Session } from "./session";
import type { Signal } from "./signal";

export interface App {
  readonly project: History<Project>;
  readonly session: Signal<Session>;
  /** The pose while it is denoised; null: nothing is being drawn, or nothing of it was sent. */
  readonly denoising: Signal<MotionClip | null>;
}

/** The motion that is on the stage. */
export function shownClip(app: App): MotionClip | null {
  const { clips } = app.session.value;
  return clips[app.project.value.kept] ?? clips[0] ?? null;
}

/** Seconds that the playhead may go to. */
export function duration(app: App): number {
  const clip = shownClip(app);
  const fan = app.session.value.fan?.clips[0]?.seconds ?? 0;
  return Math.max(length(app.project.value), clip?.seconds ?? 0, fan);
}
