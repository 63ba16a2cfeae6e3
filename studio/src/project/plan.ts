/** Which jobs of the server make a project's motion. */

import { type Project, type Range, type Take, begins, length } from "./model";
import { STANDS_STILL, type TimelineJson, constraintCount, goalOf, timelineOf } from "./goals";
import { trackJobs } from "./tracks";
import { personWithoutPath } from "./constraints";
import type { Place, Problem } from "./places";
import { between } from "./timeline";
import type { ComposeRequest, DuetRequest, EditRequest, Goals } from "../server/types";

/** One job; where `motion` is missing in an edit, it is the result of the job before. */
export type Job = ComposeRequest | DuetRequest | UnfinishedEdit;
type UnfinishedEdit = Omit<EditRequest, "motion"> & { motion?: string };

/** Jobs one after the other, what is missing, or nothing to do. */
export type Plan = { jobs: Job[]; missing: null } | { jobs: []; missing: Problem | null };

export function plan(project: Project): Plan {
  if (project.base) return redraw(project, project.base);
  if (project.segments.every((one) => !one.text.trim())) {
    const at: Place = { kind: "segment", id: project.segments[0]!.id };
    return { jobs: [], missing: { message: "No block has words yet; say what the person does.", at } };
  }
  const who = personWithoutPath(project);
  if (who >= 0) {
    const message = "Joints and poses over several blocks need the person's way; draw a path (P).";
    return { jobs: [], missing: { message, at: { kind: "path", who } } };
  }
  const { seed, count } = project;
  const first: Job =
    project.people.length > 1 ? duet(project) : { task: "compose", timeline: timelineOf(project), seed, count };
  return { jobs: [first, ...trackJobs(project, length(project), null)], missing: null };
}

/** What a draw depends on: as long as it is the same, so is the motion. */
export function planKey(project: Project): string {
  return JSON.stringify(plan(project).jobs);
}

/** Whether the takes are what the project asks for. */
export function isUpToDate(project: Project): boolean {
  return project.drawn === planKey(project);
}

/** Blocks whose motion on the stage was drawn from other words, by their ids. */
export function stale(project: Project): ReadonlySet<string> {
  const { segments, base, frozen, drawn } = project;
  if (!project.takes.length || isUpToDate(project)) return new Set();
  if (base) {
    const at = begins(segments);
    const free = between(frozen, length(project));
    const isFree = (index: number) => free.some(([from, to]) => from < at[index + 1]! - 1e-6 && to > at[index]! + 1e-6);
    return new Set(segments.filter((_, index) => isFree(index)).map((one) => one.id));
  }
  const [job] = JSON.parse(drawn || "[]") as { timeline?: TimelineJson }[];
  const old = job?.timeline?.segments.map((one) => one.text) ?? [];
  const now = timelineOf(project).segments.map((one) => one.text);
  if (!old.length) return new Set();
  let first = 0;
  while (first < Math.min(old.length, now.length) && old[first] === now[first]) first += 1;
  let rest = 0;
  while (rest < Math.min(old.length, now.length) - first && old.at(-1 - rest) === now.at(-1 - rest)) rest += 1;
  const isSame = (index: number) => old.length === now.length && old[index] === now[index];
  const changed = segments.slice(first, now.length - rest).filter((_, index) => !isSame(first + index));
  return new Set(changed.map((one) => one.id));
}

/** The motion without its stretches that stay, each drawn from the words that are there, and the tracks over it. */
function redraw(project: Project, base: Take): Plan {
  const { seed, count } = project;
  const at = begins(project.segments);
  const jobs: UnfinishedEdit[] = [];
  const free = between(project.frozen, Math.min(base.seconds, length(project)));
  for (const [from, to] of free) {
    for (const person of changedBlocks(project)) {
      project.segments.forEach((one, index) => {
        const range: Range = [Math.max(from, at[index]!), Math.min(to, at[index + 1]!)];
        const prompt = (person === 1 && one.other.trim()) || one.text.trim();
        if (range[1] - range[0] > 0.01 && prompt)
          jobs.push({ task: "edit", prompt, between: [range], person, seed, count: 1 });
      });
    }
  }
  // As many takes as there are to be are made by the last redrawn stretch, or else by the first track.
  const last = Math.max(jobs.length - 1, 0);
  jobs.push(...trackJobs(project, base.seconds, free));
  if (!jobs.length) return { jobs: [], missing: null };
  jobs[0] = { ...jobs[0]!, motion: base.motion };
  jobs[last] = { ...jobs[last]!, count };
  return { jobs, missing: null };
}

/** Who of the take is drawn anew. */
function changedBlocks({ base, only }: Project): number[] {
  const people = base?.people ?? 1;
  return only !== null && only < people ? [only] : Array.from({ length: people }, (_, person) => person);
}

/** Two people: both from words with the path of one, or the second as an answer to the first. */
function duet(project: Project): Job {
  const { seed, count, reactTo } = project;
  if (reactTo) {
    const prompt = project.segments.map((one) => one.other.trim() || one.text.trim() || STANDS_STILL).join(", then ");
    return { task: "duet", react_to: reactTo.motion, prompt, seed, count };
  }
  const person = constraintCount(project);
  const goals = goalOf(project.people[person]!, length(project));
  const timeline = timelineOf(project);
  const other = goalOf(project.people[1 - person]!, length(project));
  // Who goes where has to be known of both.
  if (timeline.path && goals?.path && other?.path)
    return { task: "duet", timeline, other_goals: other as Goals, seed, count, person };
  if (!goals || goals.path || person === 0) return { task: "duet", timeline, seed, count, person };
  return { task: "duet", prompt: timeline.segments[0]!.text, seconds: length(project), goals, seed, count, person };
}
