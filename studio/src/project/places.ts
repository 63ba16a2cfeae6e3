/** Where on the page a sentence of the server belongs: the block, path, target or pose that caused it. */

import { JOINTS, jointName } from "../body/skeleton";
import { type TimelineJson, constraintCount, timelineOf } from "./goals";
import type { Project, Target } from "./model";

export type Place =
  | { readonly kind: "segment"; readonly id: string }
  | { readonly kind: "path"; readonly who: number }
  | { readonly kind: "target"; readonly who: number; readonly id: string }
  | { readonly kind: "pose"; readonly who: number; readonly id: string };

/** What went wrong, in a sentence, and where it belongs; null: to no part of the project. */
export interface Problem {
  readonly message: string;
  readonly at: Place | null;
  /** The server's disk has no room for it. */
  readonly isFull?: boolean;
}

/** `where`: keys of the timeline, such as `segments[1].goal.joints[0]`, as far as the server knows them. */
export function placeOf(project: Project, sentence: string, where: string): Place | null {
  const asks = atJoint(project, sentence) ?? atGoal(project, where);
  if (asks) return asks;
  const inFile = /^segments\[(\d+)\]/.exec(where);
  const named = /\bsegment (\d+)\b/.exec(sentence);
  const segment = project.segments[inFile ? Number(inFile[1]) : named ? Number(named[1]) - 1 : -1];
  if (segment) return { kind: "segment", id: segment.id };
  return /^path\b/.test(where) || /\bpath\b/.test(sentence) ? pathPlace(project) : null;
}

/** A sentence without the keys that somebody who writes no file has never seen. */
export function withoutKeys(sentence: string): string {
  const plain = sentence.replace(/^the timeline, [\w.[\]]+: (?:(?:goal|path): )?/, "");
  return plain
    .replace(/'(?:path|joints|points|poses|time|position|times|facing)[\w.[\]]*' /, "")
    .replace(/\b([a-z]+(?:_[a-z]+)+)\b/g, (name) =>
      JOINTS.includes(name as (typeof JOINTS)[number])
        ? jointName(JOINTS.indexOf(name as (typeof JOINTS)[number]))
        : name,
    );
}

/** "asks for left_wrist at 1.20 s ..." and "left_wrist at 1.20 s is ...". */
function atJoint(project: Project, sentence: string): Place | null {
  const [, name, time] = /\b([a-z0-9]+(?:_[a-z0-9]+)*) at (\d+(?:\.\d+)?) s\b/.exec(sentence) ?? [];
  const joint = JOINTS.indexOf(name as (typeof JOINTS)[number]);
  return joint < 0 ? null : askAt(project, joint, Number(time));
}

/** The goal with this key in the timeline that was sent. */
function atGoal(project: Project, where: string): Place | null {
  const found = /\.?joints\[(\d+)\](?:\.points\[(\d+)\])?/.exec(where);
  if (!found) return null;
  const timeline: TimelineJson = timelineOf(project);
  const goal = where.startsWith("path") ? timeline.path : timeline.segments[0]!.goal;
  const item = goal?.joints?.[Number(found[1])];
  const point = item?.points?.[Number(found[2] ?? 0)];
  return item && point ? askAt(project, JOINTS.indexOf(item.joint as (typeof JOINTS)[number]), point.time) : null;
}

function askAt(project: Project, joint: number, time: number): Place | null {
  const who = constraintCount(project);
  const { targets, poses } = project.people[who]!;
  const covers = (one: Target) =>
    one.joint === joint && one.time - 0.06 < time && time < (one.until ?? one.time) + 0.06;
  const target = targets.find(covers);
  if (target) return { kind: "target", who, id: target.id };
  const pose = poses.find((one) => Math.abs(one.time - time) < 0.06);
  return pose ? { kind: "pose", who, id: pose.id } : joint === 0 ? pathPlace(project) : null;
}

function pathPlace(project: Project): Place | null {
  const who = constraintCount(project);
  return project.people[who]!.path || project.given?.path ? { kind: "path", who } : null;
}
