/** Files that are dropped or chosen, and files that are written. */

import { SUFFIX, checked, read, written } from "../project/file";
import { constraintCount, timelineOf } from "../project/goals";
import { CHANGED, type Project, type Stamp, keptTake } from "../project/model";
import { trackCommands } from "../project/tracks";
import { opened } from "../project/opened";
import {
  type Format,
  bytes,
  motionFile,
  timelineJson,
  timelineYaml,
  uploadCharacter,
  uploadMotion,
} from "../server/api";
import { Refused } from "../server/http";
import { type App, fail, problemOf } from "./app";
import type { Deeds } from "./deeds";
import type { Projects } from "./projects";
import type { Unnamed } from "./session";

const MOTIONS = [".bvh", ".amc", ".npz", ".glb", ".asf"];
/** Bytes of a page from which on its size is said. */
const LARGE = 1_500_000;
const GLB_MAGIC = 0x46546c67;

/** Said in the file of a timeline whose blocks were changed one at a time. */
const ANEW =
  "# Blocks were changed one at a time, and the others kept; the command draws all of them, as 'Draw all blocks' does.\n";

/** The same of parts that do something else than the blocks. */
const PARTS = "# What single parts of the body do is laid over it, where it is written as NPZ, by:\n";
/** And of clips that they follow. */
const CLIPS = "# The NPZ of each --source is in the project folder, in motions.\n";

export class Files {
  /** The skeleton that came last, for AMC files. */
  private asf: string | null = null;

  constructor(
    private readonly app: App,
    private readonly deeds: Deeds,
    private readonly projects: Projects,
  ) {}

  /** Whatever was dropped: motions, characters, timelines, projects. */
  async open(files: readonly File[]): Promise<void> {
    // A skeleton goes before the motions that need it.
    for (const file of [...files].sort((a, b) => Number(isAsf(b)) - Number(isAsf(a)))) {
      const reading = `Reading ${file.name} …`;
      this.app.session.update({ told: reading });
      await this.report(file.name, () => this.openOne(file));
      if (this.app.session.value.told === reading) this.app.session.update({ told: null });
    }
  }

  /** `share`: a page that plays it on the project's own character. */
  async export(choice: Format | "yaml" | "project" | "share"): Promise<void> {
    const { value } = this.app.project;
    const name = fileName(value.name);
    await this.report("Export", async () => {
      if (choice === "project") return saveFile(value, this.app.session.value.stamp);
      if (choice === "yaml") return this.exportYaml(value, name);
      const take = keptTake(value);
      if (!take) throw new Error("there is no motion yet; write what the person does and wait for it to be drawn.");
      const format = choice === "share" ? "html" : choice;
      const skeleton = ["bvh", "glb", "share"].includes(choice) ? value.character?.id : undefined;
      const onePerson = format === "bvh" || format === "npz" || (format === "glb" && skeleton !== undefined);
      const people = take.people > 1 && onePerson ? [0, 1] : [undefined];
      for (const person of people) {
        const blob = await bytes(motionFile(take.motion, format, { skeleton, person }));
        download(blob, `${name}${person === undefined ? "" : `_${person + 1}`}.${format}`);
        if (choice === "share" && blob.size > LARGE)
          this.app.session.update({
            told: `The page has ${(blob.size / 1e6).toFixed(1)} MB with your character in it.`,
          });
      }
    });
  }

  private async exportYaml(project: Project, name: string): Promise<void> {
    if (project.base)
      throw new Error("frozen stretches are not in a timeline file; unfreeze them, or export the motion itself.");
    if (project.reactTo) throw new Error("an answer to a clip is not in a timeline file; export the motion itself.");
    const parts = trackCommands(project, name);
    const yaml = await timelineYaml(timelineOf(project, keptTake(project)?.seed ?? project.seed));
    const isChanged = keptTake(project)?.how === CHANGED;
    const head = [
      `# motionloom ${command(project, `${name}.yaml`)}\n`,
      isChanged ? ANEW : "",
      parts.length ? PARTS : "",
      parts.some((one) => one.includes(" --source ")) ? CLIPS : "",
      ...parts.map((one) => `# motionloom ${one}\n`),
    ].join("");
    download(new Blob([head, yaml]), `${name}.yaml`);
  }

  private async openOne(file: File): Promise<void> {
    const name = file.name.toLowerCase();
    if (name.endsWith(".json")) return this.projects.add(read(await file.text()));
    if (name.endsWith(".yaml") || name.endsWith(".yml")) return this.openTimeline(file);
    if (name.endsWith(".vrm")) return void (await this.character(file));
    if (isAsf(file)) {
      this.asf = (await uploadMotion(file)).id;
      return;
    }
    if (!MOTIONS.some((suffix) => name.endsWith(suffix))) {
      throw new Error(`this page opens ${MOTIONS.join(" ")} .vrm .yaml and ${SUFFIX} files.`);
    }
    if (name.endsWith(".glb")) return this.openGlb(file);
    this.deeds.addClip(await uploadMotion(file, name.endsWith(".amc") ? this.asf : null), file.name);
  }

  /** A body becomes the character, a motion a clip; somebody is told of what is not in the file. */
  private async openGlb(file: File): Promise<void> {
    const { hasMotion, hasBody, hasMesh } = await glbContents(file);
    if (!hasMotion && !hasBody)
      throw new Error(
        hasMesh
          ? "there is a body in it, but no skeleton that could move it; export it with its armature and its weights."
          : "there is neither a body nor a motion in it; export a character with its armature, or an animation.",
      );
    if (hasBody && !(await this.character(file))) return;
    if (!hasMotion) return;
    this.deeds.addClip(await uploadMotion(file), file.name);
    if (!hasBody)
      this.app.session.update({
        told: `There is no body in ${file.name}, so the person on the stage stays; its motion is among the clips.`,
      });
  }

  /** Use the refused character with the joints that somebody named; gives the sentence of what is wrong with them. */
  async nameJoints(joints: Record<string, string>): Promise<string | null> {
    const file = this.app.session.value.unnamed?.file;
    try {
      if (file) await this.take(file, joints);
      this.app.session.update({ dialog: null, unnamed: null });
      return null;
    } catch (error) {
      return problemOf(this.app, error).message;
    }
  }

  /** Use a character; false: somebody is asked which of its joints is which. */
  private async character(file: File): Promise<boolean> {
    try {
      await this.take(file);
      return true;
    } catch (error) {
      const { joints, guesses } = (error instanceof Refused ? error.about : {}) as Partial<Unnamed>;
      if (!joints || !guesses) throw error;
      this.app.session.update({ unnamed: { file, joints, guesses }, dialog: "joints" });
      return false;
    }
  }

  private async take(file: File, joints: Record<string, string> = {}): Promise<void> {
    const { id } = await uploadCharacter(file, joints);
    this.app.project.change(`use ${file.name}`, (old) => ({ ...old, character: { id, name: file.name } }));
  }

  private async openTimeline(file: File): Promise<void> {
    const found = (await timelineJson(file)) as Record<string, unknown>;
    const second = /^#.* --person 2\b/.test(await file.slice(0, 500).text());
    await this.projects.add(checked(opened(found, file.name.replace(/\.ya?ml$/i, ""), second ? 1 : 0)));
  }

  private async report(what: string, deed: () => Promise<void>): Promise<void> {
    try {
      this.app.session.update({ error: null });
      await deed();
    } catch (error) {
      fail(this.app, error, what);
    }
  }
}

/** What makes the same motion of a timeline file. */
function command(project: Project, file: string): string {
  if (project.people.length === 1) return `compose ${file}`;
  return `duet --timeline ${file} --person ${constraintCount(project) + 1}`;
}

function isAsf(file: File): boolean {
  return file.name.toLowerCase().endsWith(".asf");
}

export function download(blob: Blob, name: string): void {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 30_000);
}

/** The project as a file of its user; `more` goes behind its name. */
export function saveFile(project: Project, stamp: Stamp, more = ""): void {
  const data = new Blob([written(project, stamp)], { type: "application/json" });
  download(data, `${fileName(project.name)}${more}${SUFFIX}`);
}

/** Whether a GLB moves, whether it has a body on joints, by weights or piece by piece, and whether it has any mesh. */
async function glbContents(file: File): Promise<{ hasMotion: boolean; hasBody: boolean; hasMesh: boolean }> {
  const head = new DataView(await file.slice(0, 20).arrayBuffer());
  if (head.byteLength < 20 || head.getUint32(0, true) !== GLB_MAGIC)
    throw new Error("it is no GLB file; its first bytes are not 'glTF'.");
  const text = await file.slice(20, 20 + head.getUint32(12, true)).text();
  let found: { animations?: unknown[]; skins?: unknown[]; meshes?: unknown[] };
  try {
    found = JSON.parse(text) as typeof found;
  } catch {
    throw new Error("it is no GLB file: its description cannot be read; export it again.");
  }
  const hasMotion = Boolean(found.animations?.length);
  const hasMesh = Boolean(found.meshes?.length);
  return { hasMotion, hasBody: hasMesh && (hasMotion || Boolean(found.skins?.length)), hasMesh };
}

/** The name of a project as that of a file. */
export function fileName(name: string): string {
  return (
    name
      .trim()
      .replaceAll(/[^\p{L}\p{N}_-]+/gu, "_")
      .slice(0, 60) || "motion"
  );
}
