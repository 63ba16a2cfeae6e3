/** What the server can be asked, with its answers as values of the page. */

import { type MotionClip, POSE, motionClip } from "../body/clip";
import { filed, stampOf } from "../project/file";
import type { TimelineJson } from "../project/goals";
import type { Note, Overlap, Project, Stamp, Take } from "../project/model";
import { getJson, json, plainJson, plainText, request } from "./http";
import type { JobRequest } from "./types";

export interface Result {
  readonly id: string;
  readonly seed: number;
  readonly seconds: number;
  readonly frames: number;
  readonly people: number;
  /** What each person did, as it was measured. */
  readonly happened?: Events;
  readonly remarks?: readonly string[];
  /** `redrawn`: the blocks that were drawn, where the others were kept of an older motion. */
  readonly measures?: { readonly redrawn?: readonly number[]; readonly overlaps?: readonly Overlap[] };
  /** The remarks that are about some words. */
  readonly notes?: readonly Note[];
  /** The motion that edits were laid over, one after the other. */
  readonly under?: string;
}

type Events = readonly ({ readonly sentence: string } | null)[];

export interface JobState {
  readonly id: string;
  readonly state: string;
  readonly error: string | null;
  /** The HTTP status that goes with the error. */
  readonly status: number | null;
  /** How the words were read, and which of them nobody learned. */
  readonly remarks?: readonly string[];
  /** The same, each with the words that it is about. */
  readonly notes?: readonly Note[];
  readonly results: readonly Result[];
}

export type Format = "bvh" | "glb" | "npz" | "mp4" | "png" | "html";

export async function isUp(): Promise<boolean> {
  try {
    await request("health", { signal: AbortSignal.timeout(3000) });
    return true;
  } catch {
    return false;
  }
}

export async function startJob(job: JobRequest, signal?: AbortSignal): Promise<string> {
  return (await getJson<{ id: string }>("jobs", { ...json("POST", job), signal })).id;
}

export async function cancelJob(id: string): Promise<void> {
  await request(`jobs/${id}`, { method: "DELETE" }).catch(() => undefined);
}

export function jobState(id: string, signal?: AbortSignal): Promise<JobState> {
  return getJson(`jobs/${id}`, { signal });
}

const cache = new Map<string, Promise<MotionClip>>();
const CACHED = 40;

/** A motion; the last ones are kept, so that undo shows them at once. */
export function motion(id: string): Promise<MotionClip> {
  const known = cache.get(id);
  if (known) return known;
  const asked = places(`motions/${encodeURIComponent(id)}?looks=true`);
  cache.set(id, asked);
  asked.catch(() => cache.delete(id));
  if (cache.size > CACHED) cache.delete(cache.keys().next().value!);
  return asked;
}

/** Where everybody's joints are and where they look, as bytes: a text would have to be taken apart number by number. */
async function places(path: string): Promise<MotionClip> {
  const answer = await request(path, { headers: { Accept: "application/octet-stream" } });
  const all = new Float32Array(await answer.arrayBuffer());
  const [fps, count] = ["Motion-Fps", "Motion-People"].map((name) => Number(answer.headers.get(name)));
  const frames = all.length / count! / (POSE + 3);
  const parts = (from: number, size: number) =>
    Array.from({ length: count! }, (_, person) => all.subarray(from + person * size, from + (person + 1) * size));
  return motionClip(fps!, parts(0, frames * POSE), parts(count! * frames * POSE, frames * 3));
}

/** The address of a motion as a file. */
export function motionFile(id: string, format: Format, options: { skeleton?: string; person?: number } = {}): string {
  const query = new URLSearchParams();
  if (options.skeleton) query.set("skeleton", options.skeleton);
  if (options.person !== undefined) query.set("person", String(options.person));
  return `motions/${encodeURIComponent(id)}.${format}${query.size ? `?${query}` : ""}`;
}

/** `asf`: the id of the skeleton that an AMC file needs. */
export async function uploadMotion(file: File, asf: string | null = null): Promise<Result> {
  const query = new URLSearchParams({ name: plainText(file.name), ...(asf ? { asf } : {}) });
  return getJson(`motions?${query}`, { method: "POST", body: file });
}

/** `joints`: which of its joints are which, as far as somebody said so. */
export async function uploadCharacter(file: File, joints: Record<string, string> = {}): Promise<{ id: string }> {
  const query = new URLSearchParams({ name: plainText(file.name) });
  if (Object.keys(joints).length) query.set("joints", plainJson(joints));
  return getJson(`characters?${query}`, { method: "POST", body: file });
}

export async function bytes(path: string): Promise<Blob> {
  return (await request(path)).blob();
}

export async function savedProject(): Promise<unknown> {
  return getJson("project");
}

/**
 * Save a project as the state after `stamp`; gives the new one. `over`: what may be replaced although it is another.
 *
 * Raises `Refused` 409 where the server has something that this does not follow from.
 */
export async function saveProject(project: Project, stamp: Stamp, over: Stamp | null = null): Promise<Stamp> {
  const init = json("PUT", filed(project, stamp));
  const query = over ? `?${new URLSearchParams({ over: `${over.id}.${over.revision}` })}` : "";
  // Small ones arrive though the tab is closed meanwhile; browsers send no more than 64 KB so.
  const answer = await request(`project${query}`, { ...init, keepalive: String(init.body).length < 60_000 });
  return stampOf(await answer.json()) ?? stamp;
}

/** Which project the server has, and which state of it; null: none. */
export async function savedStamp(): Promise<Stamp | null> {
  return stampOf(await getJson("project/stamp"));
}

/** A project of the server's folder, as a list shows it. */
export interface ProjectRow {
  readonly id: string;
  readonly name: string;
  readonly saved: string;
  readonly words: readonly string[];
  readonly blocks: number;
  readonly seconds: number;
  readonly motion: string | null;
  readonly open?: boolean;
}

/** The projects of the server's folder, the open one first. */
export function projectRows(): Promise<readonly ProjectRow[]> {
  return getJson("projects");
}

/** Let the server open another project of its folder. */
export async function openProject(id: string): Promise<void> {
  await request(`project/open?${new URLSearchParams({ id })}`, { method: "POST" });
}

/** A sentence as blocks: one for each action. */
export async function blocksOf(sentence: string): Promise<readonly { text: string; seconds: number }[]> {
  type Found = { segments: { text: string; seconds: number }[] };
  return (await getJson<Found>("sentence.json", { method: "POST", body: plainText(sentence) })).segments;
}

/** Let the server keep what it has under another name, which is given. */
export async function putAside(): Promise<string> {
  return (await getJson<{ kept: string }>("project/aside", { method: "POST" })).kept;
}

/** The timeline as the YAML file that the command line reads. */
export async function timelineYaml(timeline: TimelineJson): Promise<Blob> {
  return (await request("timeline.yaml", json("POST", timeline))).blob();
}

/** The timeline in a YAML file. */
export async function timelineJson(yaml: Blob): Promise<unknown> {
  return getJson("timeline.json", { method: "POST", body: yaml });
}

export function takeOf(result: Result, how: string): Take {
  const { id, seed, seconds, people, happened = [], remarks = [], notes = [] } = result;
  const others = remarks.filter((line) => !notes.some((one) => one.line === line));
  const { overlaps = [] } = result.measures ?? {};
  const told = [...sentences(happened), ...others.map(unseen)];
  const seen = notes.map((one) => ({ ...one, line: unseen(one.line) }));
  return { motion: id, seed, seconds, people, how, told, notes: seen, overlaps };
}

/** What was looked for in vain, without how often and in which sentence. */
export function unseen(line: string): string {
  return line.replace(/^('.*': )?not found in \d+ attempts?: /, "not seen: ");
}

function sentences(happened: Events): string[] {
  const said = happened.map((one, who) => one && `${happened.length > 1 ? `Person ${who + 1} ` : ""}${one.sentence}`);
  return said.filter((one) => one !== null);
}

const measured = new Map<string, Promise<string[]>>();

/** What happens in a motion between two seconds, a sentence for each person. */
export function deeds(motion: string, begin: number, end: number): Promise<string[]> {
  const path = `motions/${encodeURIComponent(motion)}/deeds?begin=${begin}&end=${end}`;
  const known = measured.get(path);
  if (known) return known;
  const asked = getJson<{ happened: Events }>(path).then(({ happened }) => sentences(happened));
  measured.set(path, asked);
  asked.catch(() => measured.delete(path));
  if (measured.size > 500) measured.delete(measured.keys().next().value!);
  return asked;
}

/** Little-endian float32 in base64. */
export function floats(base64: string): Float32Array {
  const text = atob(base64);
  const data = new Uint8Array(text.length);
  for (let n = 0; n < text.length; n += 1) data[n] = text.charCodeAt(n);
  return new Float32Array(data.buffer, 0, data.length >> 2);
}
