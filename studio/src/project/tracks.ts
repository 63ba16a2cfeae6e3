/** Parts of the body that do something else, for some seconds, than the words of the blocks say. */

import { HEAD, LEFT, NECK, RIGHT, jointName } from "../body/skeleton";
import {
  type Person,
  type Project,
  type Range,
  type Track,
  OTHER,
  clamp,
  length,
  newId,
  round,
  toFrame,
} from "./model";
import { changePerson } from "./timeline";
import type { EditRequest } from "../server/types";

/** Seconds that are evened out where nobody says how many, and at most. */
export const SMOOTH = 0.3;
export const SMOOTHEST = 2;
/** Seconds of the shortest stretch. */
const LEAST = 0.2;

/** The parts by their names, each with what of the body stays as it is. */
export const PARTS = {
  body: { name: "Whole body", keep: [] },
  arms: { name: "Arms", keep: ["lower_body", "torso", "head_neck"] },
  right_arm: { name: "Right arm", keep: ["lower_body", "torso", "head_neck", "left_arm"] },
  left_arm: { name: "Left arm", keep: ["lower_body", "torso", "head_neck", "right_arm"] },
  legs: { name: "Legs", keep: ["left_arm", "right_arm"] },
  head: { name: "Head", keep: ["lower_body", "torso", "left_arm", "right_arm"] },
} as const;

export type Part = keyof typeof PARTS;

/** The tracks of one person, the parts in their order. */
export const ORDER = Object.keys(PARTS) as Part[];

export function isPart(name: string): name is Part {
  return name in PARTS;
}

/** A part that does something of its own from one time to another: an arm, or a head that looks somewhere. */
export function addTrack(
  project: Project,
  who: number,
  [from, until]: Range,
  id = newId(),
  { look = null, smooth = 0 }: Partial<Pick<Track, "look" | "smooth">> = {},
): Project {
  const part = smooth ? "body" : look ? "head" : "right_arm";
  const track: Track = { id, part, text: "", clip: null, look, smooth, ...within(project, from, until) };
  return changePerson(project, who, (person) => ({ ...person, tracks: [...person.tracks, track] }));
}

export function changeTrack(project: Project, who: number, id: string, part: Partial<Track>): Project {
  return changePerson(project, who, (person) => {
    const old = person.tracks.find((one) => one.id === id);
    if (!old) return person;
    const next = { ...old, ...part };
    const fitted = { ...next, ...within(project, next.from, next.until) };
    if (JSON.stringify(fitted) === JSON.stringify(old)) return person;
    return { ...person, tracks: person.tracks.map((one) => (one === old ? fitted : one)) };
  });
}

/** Move a stretch so that it begins at a time. */
export function shiftTrack(project: Project, who: number, id: string, time: number): Project {
  const old = trackOf(project, who, id);
  if (!old) return project;
  const from = clamp(toFrame(time), 0, Math.max(length(project) - (old.until - old.from), 0));
  return changeTrack(project, who, id, { from, until: from + old.until - old.from });
}

export function removeTrack(project: Project, who: number, id: string): Project {
  return changePerson(project, who, (person) => ({ ...person, tracks: person.tracks.filter((one) => one.id !== id) }));
}

export function trackOf(project: Project, who: number, id: string): Track | undefined {
  return project.people[who]?.tracks.find((one) => one.id === id);
}

/** What a take was drawn with, of everybody's tracks: it says whether a track is in its frames already. */
export function trackKeys(project: Project): string[] {
  return project.people.flatMap((person, who) =>
    person.tracks.filter((one) => editRequest(project, who, one)).map((one) => trackKey(who, one)),
  );
}

export function trackKey(who: number, { part, text, clip, look, smooth, from, until }: Track): string {
  return JSON.stringify([who, part, text.trim(), clip?.motion, look, from, until, ...(smooth ? [smooth] : [])]);
}

/** What the part is to do, in a word or two; empty: nothing yet. */
export function trackText({ part, text, clip, look, smooth }: Track): string {
  if (smooth) return `smoothed, ${smooth} s`;
  if (clip) return clip.name;
  if (part !== "head" || !look) return text.trim();
  return look === OTHER ? "looks at the other" : "looks at a point";
}

/** What an edit says of it; null: nothing is asked. */
function editRequest(
  project: Project,
  who: number,
  { part, text, clip, look, smooth }: Track,
): Partial<EditRequest> | null {
  const { keep } = PARTS[part];
  if (smooth) return { smooth, keep };
  if (clip) return { source: clip.motion, keep };
  if (part !== "head" || !look) return text.trim() ? { prompt: text.trim(), keep } : null;
  if (look === OTHER) return project.people.length > 1 ? { look_at: 1 - who } : null;
  return { look };
}

/**
 * The edits that lay the tracks over a motion of `seconds`, one after the other. `free`: the stretches that are drawn
 * anew; null: all. What is in the frames that stay already is laid over the others alone.
 */
export function trackJobs(
  project: Project,
  seconds: number,
  free: readonly Range[] | null,
): Omit<EditRequest, "motion">[] {
  const there = new Set(free && project.base?.tracks);
  return project.people.flatMap((person, who) =>
    person.tracks.flatMap((one) => {
      const doing = editRequest(project, who, one);
      const spans = there.has(trackKey(who, one)) ? free! : [[0, seconds] as const];
      const between = spans
        .map(([from, to]): Range => [Math.max(from, one.from), Math.min(to, one.until, seconds)])
        .filter(([from, to]) => to - from >= LEAST - 1e-6);
      if (!doing || !between.length) return [];
      return [{ task: "edit" as const, ...doing, between, person: who, seed: project.seed, count: 1 }];
    }),
  );
}

/** What lays the tracks over the motion `NAME.npz` of a timeline file, as commands; the last one writes the whole. */
export function trackCommands(project: Project, name: string): string[] {
  const jobs = trackJobs(project, length(project), null);
  if (jobs.some((job) => job.person || job.look_at !== undefined))
    throw new Error("parts of two people are in no timeline file; export the motion.");
  return jobs.map(({ prompt, source, look, smooth, keep = [], between = [], seed }, index) => {
    const said = smooth
      ? ` --smooth ${smooth}`
      : look
        ? ` --look ${look.join(" ")}`
        : source
          ? ` --source ${source}.npz`
          : ` '${prompt!.replaceAll("'", "'\\''")}'`;
    const kept = keep.map((name) => ` --keep ${name}`).join("");
    const spans = between.map((span) => ` --between ${span.join(" ")}`).join("");
    const [old, next] = [index ? `${name}_${index}` : name, `${name}_${index + 1}`];
    return `edit ${old}.npz${said}${kept}${spans} --seed ${seed} --out ${next}.npz`;
  });
}

/** The joints whose targets a part moves away from. */
const MOVED: Readonly<Record<Part, readonly number[]>> = {
  body: [],
  arms: [LEFT.shoulder, LEFT.elbow, LEFT.wrist, RIGHT.shoulder, RIGHT.elbow, RIGHT.wrist],
  right_arm: [RIGHT.shoulder, RIGHT.elbow, RIGHT.wrist],
  left_arm: [LEFT.shoulder, LEFT.elbow, LEFT.wrist],
  legs: [LEFT.hip, LEFT.knee, LEFT.ankle, LEFT.foot, RIGHT.hip, RIGHT.knee, RIGHT.ankle, RIGHT.foot],
  head: [NECK, HEAD],
};

/** Sentences about targets at whose time a part does something else: who of the two wins. */
export function fights({ targets, tracks }: Person, only: { track?: string; target?: string } = {}): string[] {
  return tracks.flatMap((track) =>
    targets
      .filter((one) => MOVED[track.part].includes(one.joint) && trackText(track) && !track.smooth)
      .filter((one) => one.time <= track.until && (one.until ?? one.time) >= track.from)
      .filter((one) => (only.track ?? track.id) === track.id && (only.target ?? one.id) === one.id)
      .map(
        (one) =>
          `“${trackText(track)}” (${PARTS[track.part].name.toLowerCase()}) is laid over the target of the ${jointName(one.joint)} at ${one.time.toFixed(2)} s, and wins; move one of the two in time to have both.`,
      ),
  );
}

function within(project: Project, from: number, until: number): { from: number; until: number } {
  const end = length(project);
  const first = clamp(toFrame(from), 0, Math.max(end - LEAST, 0));
  return { from: round(first), until: round(clamp(toFrame(until), first + LEAST, Math.max(end, first + LEAST))) };
}
