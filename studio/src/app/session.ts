/** What the page shows at the moment: nothing of it is undone, and nothing of it is in the project file. */

import type { MotionClip } from "../body/clip";
import { type Project, type Range, type Stamp, newId } from "../project/model";
import type { Problem } from "../project/places";
import { Signal } from "./signal";

export type Tool = "select" | "path" | "target";

export type Selection =
  | { readonly kind: "none" }
  | { readonly kind: "segment"; readonly id: string }
  | { readonly kind: "target"; readonly id: string }
  | { readonly kind: "pose"; readonly id: string }
  | { readonly kind: "point"; readonly index: number };

/** How far a draw is; null where none is under way. */
export interface Drawing {
  readonly done: number;
  readonly of: number;
}

/** Futures to choose from. */
export interface Fan {
  readonly clips: readonly MotionClip[];
  readonly motions: readonly string[];
  readonly past: number;
}

export interface Session {
  readonly time: number;
  readonly playing: boolean;
  readonly repeat: boolean;
  readonly rate: number;
  readonly tool: Tool;
  /** Whose path, targets and poses are edited: 0 or 1. */
  readonly person: number;
  readonly joint: number;
  readonly selection: Selection;
  /** A stretch that is marked on the ruler. */
  readonly range: Range | null;
  readonly follow: boolean;
  readonly ghosts: boolean;
  readonly trails: boolean;
  readonly sideBySide: boolean;
  readonly snapping: boolean;
  readonly help: boolean;
  readonly drawing: Drawing | null;
  /** A draw begins soon. */
  readonly pending: boolean;
  readonly fan: Fan | null;
  /** The clips of the project's takes, as far as they are here. */
  readonly clips: readonly MotionClip[];
  /** What went wrong last. */
  readonly error: Problem | null;
  readonly connected: boolean;
  /** `here`: only in this browser. */
  readonly saved: "saved" | "saving" | "here";
  readonly stamp: Stamp;
  /** Something else is on the server than what was changed here; nothing is saved until somebody says what is to be. */
  readonly conflict: Conflict | null;
  /** What the page did by itself and somebody should know. */
  readonly told: string | null;
}

/** What the server has; `stamp` null: nothing, `project` null: nothing that this page can read. */
export interface Conflict {
  readonly stamp: Stamp | null;
  readonly project: Project | null;
}

export const NOTHING: Selection = { kind: "none" };

export function newSession(): Signal<Session> {
  return new Signal<Session>({
    time: 0,
    playing: false,
    repeat: true,
    rate: 1,
    tool: "select",
    person: 0,
    joint: 21,
    selection: NOTHING,
    range: null,
    follow: true,
    ghosts: true,
    trails: false,
    sideBySide: false,
    snapping: true,
    help: false,
    drawing: null,
    pending: false,
    fan: null,
    clips: [],
    error: null,
    connected: true,
    saved: "saved",
    stamp: { id: newId(), revision: 0 },
    conflict: null,
    told: null,
  });
}
