/** Which jobs of the server make a project's motion. */

import { type Project, type Range, begins, length } from "./model";
import { type Goal, type TimelineJson, asked, goalOf, timelineOf } from "./goals";
import { needsWay } from "./asks";
import { between } from "./timeline";

/** One job; where `motion` is missing in an edit, it is the result of the job before. */
export type Job =
  | { task: "compose"; timeline: TimelineJson; seed: number; count: number }
  | { task: "duet"; timeline: TimelineJson; seed: number; count: number; person: number }
  | { task: "duet"; prompt: string; seconds: number; goals: Goal; seed: number; count: number; person: number }
  | { task: "duet"; react_to: string; prompt: string; seed: number; count: number }
  | { task: "edit"; motion?: string; prompt: string; redraw: Range[]; seed: number; count: number };

/** Jobs one after the other, the first line that says what is missing, or nothing to do. */
export type Plan = { jobs: Job[]; missing: null } | { jobs: []; missing: string | null };

export function plan(project: Project): Plan {
  if (project.base) return redraw(project);
  const empty = project.segments.findIndex((one) => !one.text.trim());
  if (empty >= 0) return { jobs: [], missing: `Block ${empty + 1} has no words yet; say what the person does.` };
  if (needsWay(project) >= 0) {
    return { jobs: [], missing: "Joints and poses over several blocks need the person's way; draw a path (P)." };
  }
  const { seed, count } = project;
  const timeline = timelineOf(project);
  if (project.people.length === 1) return { jobs: [{ task: "compose", timeline, seed, count }], missing: null };
  return { jobs: [duet(project)], missing: null };
}

/** What a draw depends on: as long as it is the same, so is the motion. */
export function planKey(project: Project): string {
  return JSON.stringify(plan(project).jobs);
}

/** The motion without its stretches that stay, each drawn from the words that are there. */
function redraw(project: Project): Plan {
  const { base, seed } = project;
  if (!base) return { jobs: [], missing: null };
  const at = begins(project.segments);
  const jobs: Job[] = [];
  for (const [from, to] of between(project.frozen, Math.min(base.seconds, length(project)))) {
    const parts = project.segments.flatMap((one, index): { text: string; range: Range }[] => {
      const range: Range = [Math.max(from, at[index]!), Math.min(to, at[index + 1]!)];
      return range[1] - range[0] > 0.01 && one.text.trim() ? [{ text: one.text, range }] : [];
    });
    for (const { text, range } of parts) jobs.push({ task: "edit", prompt: text, redraw: [range], seed, count: 1 });
  }
  const [first, last] = [jobs[0], jobs.at(-1)];
  if (!first || !last) return { jobs: [], missing: null };
  if (first.task === "edit") first.motion = base.motion;
  last.count = project.count;
  return { jobs, missing: null };
}

/** Two people: both from words with the path of one, or the second as an answer to the first. */
function duet(project: Project): Job {
  const { seed, count, reactTo } = project;
  if (reactTo) {
    const prompt = project.segments.map((one) => one.other.trim() || one.text.trim()).join(", then ");
    return { task: "duet", react_to: reactTo.motion, prompt, seed, count };
  }
  const person = asked(project);
  const goals = goalOf(project.people[person]!, length(project));
  const timeline = timelineOf(project);
  if (!goals || goals.path) return { task: "duet", timeline, seed, count, person };
  return { task: "duet", prompt: timeline.segments[0]!.text, seconds: length(project), goals, seed, count, person };
}
