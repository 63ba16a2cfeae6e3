/** A job from its request to its results, with what can be seen on the way. */

import { type MotionClip, motionClip, POSE } from "../body/clip";
import { FPS } from "../project/model";
import { type JobState, type Result, cancelJob, floats, jobState, startJob } from "./api";
import { follow } from "./events";
import { Refused, Unreachable } from "./http";
import type { JobRequest } from "./types";

/** The pose of a row while it is denoised. */
export interface Level {
  readonly level: number;
  readonly of: number;
  readonly row: number;
  /** Seconds of the motion at which the pose begins: an edit shows the part that it draws. */
  readonly begin: number;
  readonly clip: MotionClip;
}

export interface Watcher {
  progress?(done: number, of: number): void;
  level?(level: Level): void;
}

interface LevelJson {
  level: number;
  of: number;
  row: number;
  people: number;
  frames: number;
  begin: number;
  positions: string;
}

const FINAL = ["done", "failed", "cancelled"];

/**
 * Run a job; aborting `signal` cancels it on the server.
 *
 * Raises `Refused` with the library's sentence, `Unreachable`, or the signal's reason.
 */
export async function runJob(job: JobRequest, signal: AbortSignal, watcher: Watcher = {}): Promise<readonly Result[]> {
  signal.throwIfAborted();
  const id = await startJob(job);
  const cancel = () => void cancelJob(id);
  signal.addEventListener("abort", cancel, { once: true });
  try {
    if (signal.aborted) cancel();
    signal.throwIfAborted();
    return results(await finished(id, signal, watcher));
  } finally {
    signal.removeEventListener("abort", cancel);
  }
}

async function finished(id: string, signal: AbortSignal, watcher: Watcher): Promise<JobState> {
  let last: JobState | null = null;
  try {
    await follow(`jobs/${id}/events`, signal, ({ name, data }) => {
      if (FINAL.includes(name)) last = JSON.parse(data) as JobState;
      else if (name === "level") watcher.level?.(levelOf(JSON.parse(data) as LevelJson));
      else if (name === "progress") {
        const { done, of } = JSON.parse(data) as { done: number; of: number };
        watcher.progress?.(done, of);
      }
    });
  } catch (error) {
    signal.throwIfAborted();
    if (error instanceof Refused) throw error;
  }
  // A stream that broke says nothing about the job: ask for it until it is finished.
  while (!last || !FINAL.includes((last as JobState).state)) {
    signal.throwIfAborted();
    last = await jobState(id, signal);
    if (!FINAL.includes(last.state)) await new Promise((resume) => setTimeout(resume, 300));
  }
  return last;
}

function results(state: JobState): readonly Result[] {
  if (state.state === "failed")
    throw new Refused(state.error ?? "The job failed and did not say why.", state.status ?? 422);
  if (state.state === "cancelled") throw new DOMException("cancelled", "AbortError");
  const { remarks = [], notes = [] } = state;
  return state.results.map((one) => ({
    ...one,
    remarks: [...remarks, ...(one.remarks ?? [])],
    notes: [...notes, ...(one.notes ?? [])],
  }));
}

function levelOf(json: LevelJson): Level {
  const all = floats(json.positions);
  const size = json.frames * POSE;
  const people = Array.from({ length: json.people }, (_, person) => all.subarray(person * size, (person + 1) * size));
  return { level: json.level, of: json.of, row: json.row, begin: json.begin, clip: motionClip(FPS, people) };
}

/** Whether an error means that the server is away rather than that it said no. */
export function isAway(error: unknown): boolean {
  return error instanceof Unreachable;
}
