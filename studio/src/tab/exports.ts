/** The motion as files. */

import { h } from "../app/dom";
import { textButton } from "../panels/parts";
import type { Body } from "../prior/person";
import { bvh } from "./bvh";
import type { Character } from "./character";
import { saved } from "./files";
import { glb } from "./glb";
import type { Project } from "./link";
import { MOST, shared } from "./share";
import { vrma } from "./vrma";

/** A file's name, of the first sentence. */
export function nameOf({ segments }: Project): string {
  const words = segments[0]!.text.toLowerCase().replace(/[^a-z0-9]+/g, "_");
  return words.slice(0, 40) || "motion";
}

/** Buttons for files of a motion; `say` is called with a sentence about one that failed or is large. */
export function exportButtons(
  body: Body,
  project: Project,
  character: Character | null,
  say: (sentence: string) => void,
): HTMLElement[] {
  const name = nameOf(project);
  const write = async (): Promise<void> =>
    character
      ? saved(`${name}_${character.name}.glb`, character.glb(body, name))
      : saved(`${name}.glb`, await glb(body, name));
  const share = async (by: Character | null): Promise<void> => {
    try {
      const viewer = await fetch("viewer.html").catch(() => null);
      if (!viewer?.ok) throw new Error("the viewer cannot be loaded; load the page again when online");
      const words = project.segments.map(({ text }) => text.trim()).join(", ");
      const text = await shared(await viewer.text(), body, words.slice(0, 200), by);
      saved(`${name}.html`, text);
      const size = `${(text.length / 1e6).toFixed(1)} MB`;
      say(by && text.length > MOST ? `${name}.html has ${size}: ${by.name} with its pictures is most of it.` : "");
    } catch (error) {
      say(`The page is not written: ${(error as Error).message}.`);
    }
  };
  const line = (said: string, ...buttons: (HTMLElement | null)[]): HTMLElement =>
    h("div", { class: "line" }, h("span", { class: "quiet grow" }, said), ...buttons);
  const own = character && `On ${character.name}`;
  return [
    line(
      "Save as",
      textButton("BVH", () => saved(`${name}.bvh`, bvh(body))),
      textButton("GLB", () => void write(), {
        title: character ? `${character.name} with the motion` : "A plain figure",
      }),
      textButton("VRMA", () => saved(`${name}.vrma`, vrma(body, name)), { title: "For any VRM avatar" }),
    ),
    line(
      "As a page that plays",
      textButton("Share", () => void share(null), { title: "One HTML file, which needs no network: send it" }),
      own ? textButton(own, () => void share(character), { title: "The same, played by your character" }) : null,
    ),
  ];
}
