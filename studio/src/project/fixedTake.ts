/** A take whose blocks are frozen until their words change. */

import { trackKeys } from "./tracks";
import { type Project, type Segment, type Take, NO_CONSTRAINTS, length, newId, round, segment, toFrame } from "./model";

/** The project with a take, all of it frozen. */
export function withFixedTake(project: Project, take: Take): Project {
  const frozen = [[0, Math.max(take.seconds, length(project))] as const];
  const kept = { ...take, tracks: trackKeys(project) };
  return { ...project, base: kept, only: null, takes: [kept], kept: 0, frozen, drawn: "[]", count: 1 };
}

/** A motion of one person with blocks of its own; the last one is made as long as the motion is. */
export function withMotion(project: Project, take: Take, segments: readonly Segment[]): Project {
  const last = segments.at(-1)!;
  const total = segments.reduce((sum, one) => sum + one.seconds, 0);
  const rest = { ...last, seconds: Math.max(round(last.seconds + take.seconds - total), 0.2) };
  const fitted = [...segments.slice(0, -1), rest];
  return withFixedTake({ ...project, people: [NO_CONSTRAINTS], reactTo: null, given: null, segments: fitted }, take);
}

/** The project with a take that continues its motion: one more block without words for what is longer. */
export function withContinuedTake(project: Project, take: Take): Project {
  const tail = round(toFrame(take.seconds - length(project)));
  return withFixedTake(
    tail >= 0.2 ? { ...project, segments: [...project.segments, segment("", tail)] } : project,
    take,
  );
}

/** A long clip as blocks of at most ten seconds, so that words can change a part of it. */
export function blocksOfClip(name: string, seconds: number): Segment[] {
  const count = Math.max(Math.ceil(seconds / 10), 1);
  const part = round(toFrame(seconds / count));
  return Array.from({ length: count }, (_, index) => ({
    ...segment(name, index < count - 1 ? part : Math.max(round(seconds - part * (count - 1)), 0.2)),
    id: newId(),
  }));
}
