/** Blocks that were copied: this browser keeps them, so that they go from one project and tab to another. */

import { checked } from "../project/file";
import { type Segment, exampleProject } from "../project/model";

const KEY = "motionloom-blocks";

export type Clipboard = readonly Segment[];

let here: Clipboard = [];

export function copied(blocks: Clipboard): void {
  here = blocks;
  try {
    localStorage.setItem(KEY, JSON.stringify(blocks));
  } catch {
    /* the browser keeps nothing; this page does */
  }
}

/** What was copied last, here or in another tab. */
export function readClipboard(): Clipboard {
  try {
    const segments: unknown = JSON.parse(localStorage.getItem(KEY) ?? "[]");
    return Array.isArray(segments) && segments.length ? checked({ ...exampleProject(), segments }).segments : here;
  } catch {
    return here;
  }
}
