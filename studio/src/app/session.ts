/** What the page shows at the moment: nothing of it is undone, and nothing of it is in the project file. */

import type { MotionClip } from "../body/clip";
import { type Project, type Range, type Stamp, type Vec3, newId } from "../project/model";
import type { Problem } from "../project/places";
import { Signal } from "./signal";

export type Tool = "select" | "path" | "target" | "meeting";

/** What is seen beside the main picture besides the front; null: nothing. */
export type Views = "side" | "above" | null;

export type Selection =
  | { readonly kind: "none" }
  /** `more`: other blocks that are selected with it. */
  | { readonly kind: "segment"; readonly id: string; readonly more?: readonly string[] }
  | { readonly kind: "marker"; readonly id: string }
  | { readonly kind: "target"; readonly id: string }
  | { readonly kind: "pose"; readonly id: string }
  | { readonly kind: "track"; readonly id: string }
  | { readonly kind: "point"; readonly index: number };

/** The ids of all blocks that are selected. */
export function chosenBlocks(selection: Selection): readonly string[] {
  return selection.kind === "segment" ? [selection.id, ...(selection.more ?? [])] : [];
}

/** These blocks as what is selected. */
export function blocksChosen([id, ...more]: readonly string[]): Selection {
  return id === undefined ? NOTHING : { kind: "segment", id, ...(more.length ? { more } : {}) };
}

/** A character that was refused, since nobody can tell its joints: what is to be named, and what is guessed. */
export interface Unnamed {
  readonly file: File;
  readonly joints: readonly { readonly name: string; readonly parent: number; readonly place: Vec3 }[];
  readonly guesses: Readonly<Record<string, string>>;
}

/** What lies over the page and waits for an answer. */
export type Dialog = "help" | "palette" | "history" | "projects" | "name" | "joints" | "film" | "backdrop";

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
  /** Joints of a pose that move with that one, and those that stay. */
  readonly joints: readonly number[];
  readonly pins: readonly number[];
  /** A pose that was copied. */
  readonly pose: readonly Vec3[] | null;
  readonly selection: Selection;
  /** A stretch that is marked on the ruler. */
  readonly range: Range | null;
  readonly follow: boolean;
  readonly ghosts: boolean;
  /** Whether ghosts show the motion a little before and behind the playhead. */
  readonly around: boolean;
  readonly trails: boolean;
  /** Whether the timeline shows how high and how fast the joint is. */
  readonly curves: boolean;
  readonly sideBySide: boolean;
  readonly views: Views;
  readonly snapping: boolean;
  /** Whether a block that is moved lies over others, which stay when they are, or pushes them aside. */
  readonly overwriting: boolean;
  readonly dialog: Dialog | null;
  readonly unnamed: Unnamed | null;
  /** Whether the first question is asked: what the person should do. */
  readonly welcome: boolean;
  /** Whether the panel is shown where the window has no room for it beside the stage. */
  readonly sheet: boolean;
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
    joints: [],
    pins: [],
    pose: null,
    selection: NOTHING,
    range: null,
    follow: true,
    ghosts: true,
    around: false,
    trails: false,
    curves: false,
    sideBySide: false,
    views: null,
    snapping: true,
    overwriting: false,
    dialog: null,
    unnamed: null,
    welcome: false,
    sheet: false,
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
