/** The motion as files. */

import { h } from "../app/dom";
import { textButton } from "../panels/parts";
import type { Body } from "../prior/person";
import { bvh } from "./bvh";
import type { Character } from "./character";
import { saved } from "./files";
import { glb } from "./glb";
import type { Project } from "./link";
import { vrma } from "./vrma";

/** A file's name, of the first sentence. */
export function nameOf({ segments }: Project): string {
  const words = segments[0]!.text.toLowerCase().replace(/[^a-z0-9]+/g, "_");
  return words.slice(0, 40) || "motion";
}

export function exportButtons(body: Body, name: string, character: Character | null): HTMLElement {
  const write = async (): Promise<void> =>
    character
      ? saved(`${name}_${character.name}.glb`, character.glb(body, name))
      : saved(`${name}.glb`, await glb(body, name));
  return h(
    "div",
    { class: "line" },
    h("span", { class: "quiet grow" }, "Save as"),
    textButton("BVH", () => saved(`${name}.bvh`, bvh(body))),
    textButton("GLB", () => void write(), {
      title: character ? `${character.name} with the motion` : "A plain figure",
    }),
    textButton("VRMA", () => saved(`${name}.vrma`, vrma(body, name)), { title: "For any VRM avatar" }),
  );
}
