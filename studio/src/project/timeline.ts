/** Edits of the prompted stretches. Each takes a project and gives a new one, or the same where nothing is to do. */

import {
  type Person,
  type Project,
  type Range,
  type Segment,
  FPS,
  LONGEST,
  NO_CONSTRAINTS,
  SHORTEST,
  begins,
  clamp,
  keptTake,
  length,
  newId,
  round,
  segment,
  toFrame,
} from "./model";

export function addSegment(project: Project, text = "", seconds = 3, at = project.segments.length): Project {
  const segments = [...project.segments];
  segments.splice(at, 0, segment(text, seconds));
  return unfrozen({ ...project, segments });
}

export function changeSegment(project: Project, id: string, part: Partial<Segment>): Project {
  const old = project.segments.find((one) => one.id === id);
  if (!old || Object.entries(part).every(([key, value]) => old[key as keyof Segment] === value)) return project;
  return { ...project, segments: project.segments.map((one) => (one.id === id ? { ...one, ...part } : one)) };
}

/**
 * Change the words of a block. Where stretches are frozen, all but this block becomes frozen; or, where the takes do not
 * have yet what was asked before, this block is drawn with it.
 */
export function write(project: Project, id: string, text: string, second = false, isDrawn = true): Project {
  const index = project.segments.findIndex((one) => one.id === id);
  const key = second ? "other" : "text";
  if (index < 0 || project.segments[index]![key] === text) return project;
  const changed = {
    ...project,
    segments: project.segments.map((one) => (one.id === id ? { ...one, [key]: text } : one)),
  };
  if (!project.base) return changed;
  const only = second ? 1 : 0;
  if (isDrawn) return freezeRest({ ...changed, base: null, only }, id);
  const at = begins(project.segments);
  const frozen = project.frozen.flatMap(([from, to]): Range[] => [
    [from, Math.min(to, at[index]!)],
    [Math.max(from, at[index + 1]!), to],
  ]);
  return {
    ...changed,
    frozen: frozen.filter(([from, to]) => to - from >= 1 / FPS),
    only: project.only === only ? only : null,
  };
}

/** Drag the end of a segment to a time; those behind it move along. */
export function resizeSegment(project: Project, id: string, end: number): Project {
  const index = project.segments.findIndex((one) => one.id === id);
  if (index < 0) return project;
  const seconds = clamp(round(toFrame(end - begins(project.segments)[index]!)), SHORTEST, LONGEST);
  if (seconds === project.segments[index]!.seconds) return project;
  return unfrozen(changeSegment(project, id, { seconds }));
}

/** Move the seam between a segment and the next; the whole stays as long as it is. */
export function moveSeam(project: Project, id: string, time: number): Project {
  const index = project.segments.findIndex((one) => one.id === id);
  const [one, next] = [project.segments[index], project.segments[index + 1]];
  if (!one || !next) return project;
  const start = begins(project.segments)[index]!;
  const both = one.seconds + next.seconds;
  const low = Math.max(SHORTEST, both - LONGEST);
  const seconds = round(clamp(toFrame(time - start), low, Math.min(both - SHORTEST, LONGEST)));
  if (seconds === one.seconds) return project;
  const moved = changeSegment(project, one.id, { seconds });
  return changeSegment(moved, next.id, { seconds: round(both - seconds) });
}

/** Without these blocks; where none is left, an empty one is there. */
export function removeSegments(project: Project, ids: readonly string[]): Project {
  const left = project.segments.filter((one) => !ids.includes(one.id));
  if (left.length === project.segments.length) return project;
  const isBlank = project.segments.length === 1 && !project.segments[0]!.text;
  if (!left.length) return isBlank ? project : addSegment({ ...project, segments: [] });
  return unfrozen({ ...project, segments: left });
}

/** Put copies of blocks before the one that is at `to`; gives the project and the ids of the copies. */
export function pasteSegments(project: Project, blocks: readonly Segment[], to: number): [Project, string[]] {
  const copies = blocks.map((one) => ({ ...one, id: newId() }));
  const segments = [...project.segments];
  segments.splice(clamp(to, 0, segments.length), 0, ...copies);
  return [unfrozen({ ...project, segments }), copies.map((one) => one.id)];
}

/** Two segments with the same words where one was, if both are long enough. */
export function splitSegment(project: Project, time: number): Project {
  const at = begins(project.segments);
  const index = project.segments.findIndex((_, number) => time < at[number + 1]!);
  const one = project.segments[index];
  if (!one) return project;
  const first = round(toFrame(time - at[index]!));
  const second = round(one.seconds - first);
  if (first < SHORTEST || second < SHORTEST) return project;
  const segments = [...project.segments];
  segments.splice(index, 1, { ...one, seconds: first, transition: null }, { ...one, id: newId(), seconds: second });
  return { ...project, segments };
}

/** Put blocks before the one that is at `to` (counted without them); the others make room. */
export function moveSegments(project: Project, ids: readonly string[], to: number): Project {
  const moved = project.segments.filter((one) => ids.includes(one.id));
  const segments = project.segments.filter((one) => !ids.includes(one.id));
  segments.splice(clamp(to, 0, segments.length), 0, ...moved);
  if (segments.every((one, index) => one === project.segments[index])) return project;
  return unfrozen({ ...project, segments });
}

/**
 * Lay blocks over others so that they begin at `time`. All else stays when it is: what they cover is cut, and the time
 * that they leave goes to the block before it, or to the one behind it at the beginning.
 */
export function layOver(project: Project, ids: readonly string[], time: number): Project {
  const moved = project.segments.filter((one) => ids.includes(one.id));
  const at = begins(project.segments);
  const rest: { one: Segment; from: number; to: number }[] = [];
  project.segments.forEach((one, index) => {
    if (!ids.includes(one.id)) rest.push({ one, from: rest.length ? at[index]! : 0, to: at[index + 1]! });
    else if (rest.length) rest.at(-1)!.to = at[index + 1]!;
  });
  if (!moved.length || !rest.length) return project;
  const under = [...rest].reverse().find(({ from }) => from <= time) ?? rest[0]!;
  let start = clamp(toFrame(time), 0, rest.at(-1)!.to);
  if (start - under.from < SHORTEST) start = under.from;
  let end = round(start + moved.reduce((sum, one) => sum + one.seconds, 0));
  const cut = rest.find(({ from, to }) => from < end && end < to);
  if (cut && cut.to - end < SHORTEST) end = cut.to;
  const last = moved.at(-1)!;
  const laid = [
    ...moved.slice(0, -1),
    { ...last, seconds: round(last.seconds + end - start - moved.reduce((sum, one) => sum + one.seconds, 0)) },
  ];
  const piece = ({ one, from, to }: (typeof rest)[number], low: number, high: number): Segment[] => {
    const seconds = round(Math.min(to, high) - Math.max(from, low));
    return seconds < SHORTEST ? [] : [{ ...one, seconds, id: from < low ? newId() : one.id }];
  };
  const segments = [
    ...rest.flatMap((one) => piece(one, 0, start)),
    ...laid,
    ...rest.flatMap((one) => piece(one, end, Infinity)),
  ];
  const fits = segments.every(({ seconds }) => seconds <= LONGEST);
  const isSame = segments.every(
    (one, index) => one.id === project.segments[index]?.id && one.seconds === project.segments[index]!.seconds,
  );
  return !fits || isSame ? project : unfrozen({ ...project, segments });
}

/** The longest transition a segment may share with the one behind it. */
export function longestTransition(project: Project, index: number): number {
  const [one, next] = [project.segments[index], project.segments[index + 1]];
  return one && next ? Math.min(one.seconds, next.seconds) / 2 : 0;
}

/** The transition that will be used: what is said, within what is possible. */
export function transitionOf(project: Project, index: number): number {
  const most = longestTransition(project, index);
  return Math.min(project.segments[index]?.transition ?? 1, most);
}

export function setTransition(project: Project, id: string, seconds: number | null): Project {
  const index = project.segments.findIndex((one) => one.id === id);
  const most = longestTransition(project, index);
  if (index < 0 || most <= 0) return project;
  const transition = seconds === null ? null : round(clamp(seconds, 0.05, most));
  return changeSegment(project, id, { transition });
}

// -- stretches that stay

/** Freeze a stretch of the kept take: the rest is drawn between what is frozen. */
export function freeze(project: Project, range: Range): Project {
  const base = project.base ?? keptTake(project);
  if (!base) return project;
  const end = Math.min(base.seconds, length(project));
  const from = clamp(toFrame(Math.min(...range)), 0, end);
  const to = clamp(toFrame(Math.max(...range)), 0, end);
  if (to - from < 1 / FPS) return project;
  const frozen = joined([...project.frozen, [from, to]]);
  return { ...project, base: project.base ?? keptTake(project), only: null, frozen };
}

/** Freeze all but one segment. */
export function freezeRest(project: Project, id: string): Project {
  const index = project.segments.findIndex((one) => one.id === id);
  const base = keptTake(project);
  if (index < 0 || !base) return project;
  const at = begins(project.segments);
  const rest: Range[] = [
    [0, at[index]!],
    [at[index + 1]!, base.seconds],
  ];
  const frozen = joined(rest.filter(([from, to]) => to - from >= 1 / FPS));
  return frozen.length ? { ...project, base, frozen } : project;
}

/** Nothing stays as it was; the words draw all of it. */
export function unfrozen(project: Project): Project {
  return project.frozen.length || project.base ? { ...project, frozen: [], base: null, only: null } : project;
}

/** The stretches of 0 to `end` that are in none of `ranges`. */
export function between(ranges: readonly Range[], end: number): Range[] {
  const free: Range[] = [];
  let at = 0;
  for (const [from, to] of joined(ranges)) {
    if (from - at >= 1 / FPS) free.push([at, from]);
    at = Math.max(at, to);
  }
  if (end - at >= 1 / FPS) free.push([at, end]);
  return free;
}

function joined(ranges: readonly Range[]): Range[] {
  const result: Range[] = [];
  for (const [from, to] of [...ranges].sort((a, b) => a[0] - b[0])) {
    const last = result.at(-1);
    if (last && from <= last[1]) result[result.length - 1] = [last[0], Math.max(last[1], to)];
    else result.push([from, to]);
  }
  return result;
}

// -- people

export function changePerson(project: Project, index: number, edit: (person: Person) => Person): Project {
  const person = project.people[index];
  if (!person) return project;
  const next = edit(person);
  return next === person ? project : { ...project, people: project.people.map((one, n) => (n === index ? next : one)) };
}

export function setPeople(project: Project, count: 1 | 2): Project {
  if (project.people.length === count) return project;
  const people = count === 2 ? [...project.people, NO_CONSTRAINTS] : project.people.slice(0, 1);
  return unfrozen({ ...project, people, reactTo: count === 1 ? null : project.reactTo });
}
