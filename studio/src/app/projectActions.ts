/** What one does with projects, files and the windows of the page. */

import { SUFFIX } from "../project/file";
import type { Format } from "../server/api";
import type { Action, Actions, Parts } from "./actions";
import { shownClip } from "./app";
import type { Dialog } from "./session";

type Written = readonly [string, string, readonly string[], Format | "share" | "yaml", string];

const EXPORTS: Readonly<Record<string, Written>> = {
  export: ["BVH", "Export BVH", ["E"], "bvh", "Blender, Unreal, MotionBuilder; on the 22 joints, or on your character"],
  exportGlb: [
    "GLB",
    "Export GLB",
    ["Shift+E"],
    "glb",
    "Godot, Unity (with a glTF importer), Blender, the web; on your character if there is one",
  ],
  exportMp4: ["MP4", "Export a film (MP4)", [], "mp4", "A film"],
  exportPng: ["PNG", "Export a sheet of poses (PNG)", [], "png", "A sheet of poses"],
  exportNpz: ["NPZ", "Export numbers (NPZ)", [], "npz", "Numbers for Python and robots"],
  share: [
    "Share",
    "Share as a web page",
    ["Ctrl+E"],
    "html",
    "One web page that plays the motion, without a network: send it",
  ],
  shareOwn: [
    "Share with your character",
    "Share as a web page, with your character",
    [],
    "share",
    "The same, and your character plays it; its file goes along",
  ],
  exportYaml: [
    "Timeline (YAML)",
    "Export the timeline as YAML",
    ["Alt+E"],
    "yaml",
    "What the command line runs to the same motion",
  ],
};

/** The name of an export in its menu. */
export function exportName(key: string): string {
  return EXPORTS[key]?.[0] ?? (key === "film" ? "Film of the stage" : "Project file");
}

/** In the order of the menu: each goal with its exports. */
const GOALS: Readonly<Record<string, readonly string[]>> = {
  "Into an engine or Blender": ["export", "exportGlb"],
  "To look at, and to send": ["share", "shareOwn", "exportMp4", "film", "exportPng"],
  "Into a program, and to go on with": ["exportNpz", "exportYaml", "save"],
};

export const EXPORT_KEYS = Object.values(GOALS).flat();

/** The goal that begins with this export; empty: none does. */
export function exportGoal(key: string): string {
  return Object.entries(GOALS).find(([, [first]]) => first === key)?.[0] ?? "";
}

export function exports({ app, files }: Parts): Actions {
  const film: Action = {
    group: "Export",
    label: "Film the stage (MP4 or GIF)",
    keys: ["Shift+V"],
    note: "As you see it, or once around the person",
    isThere: () => shownClip(app) !== null && !app.live.value,
    run: () => shownClip(app) && !app.live.value && app.session.update({ dialog: "film" }),
  };
  const written = Object.fromEntries(
    Object.entries(EXPORTS).map(([key, [, label, keys, format, note]]): [string, Action] => [
      key,
      {
        group: "Export",
        label,
        keys,
        note,
        run: () => void files.export(format),
        ...(format === "share" ? { isThere: () => app.project.value.character !== null } : {}),
      },
    ]),
  );
  return { ...written, film };
}

export function projects({ app, files, projects, choose }: Parts): Actions {
  const { project: history, session } = app;
  const group = "Project" as const;
  const show = (dialog: Dialog) => () => session.update({ dialog: session.value.dialog === dialog ? null : dialog });
  return {
    undo: {
      group,
      label: "Undo",
      keys: ["Ctrl+Z"],
      isThere: () => history.undoLabel !== null,
      run: () => void history.undo(),
    },
    redo: {
      group,
      label: "Redo",
      keys: ["Ctrl+Shift+Z", "Ctrl+Y"],
      isThere: () => history.redoLabel !== null,
      run: () => void history.redo(),
    },
    history: {
      group,
      label: "History in pictures",
      keys: ["Shift+H"],
      note: "Every state, to go back to",
      run: show("history"),
    },
    new: {
      group,
      label: "New project",
      keys: ["Alt+N"],
      note: "This one stays among the recent ones",
      run: () => void projects.blank(),
    },
    open: {
      group,
      label: "Open files",
      keys: ["Ctrl+O"],
      note: "Projects, timelines, motions and characters",
      run: choose,
    },
    recent: {
      group,
      label: "Recent projects",
      keys: ["Alt+O"],
      note: "The projects of this folder",
      run: show("projects"),
    },
    saveAs: {
      group,
      label: "Save as another project",
      keys: ["Ctrl+Shift+S"],
      note: "Goes on in a copy with a name of its own",
      run: show("name"),
    },
    save: {
      group,
      label: `Save the project as a file (${SUFFIX})`,
      keys: ["Ctrl+S"],
      note: "Everything on this page",
      run: () => void files.export("project"),
    },
  };
}

export function windows({ app, toggleTheme }: Parts): Actions {
  const { session } = app;
  const group = "Project" as const;
  const show = (dialog: Dialog) => () => session.update({ dialog: session.value.dialog === dialog ? null : dialog });
  return {
    palette: { group, label: "Everything that can be done", keys: ["Ctrl+K"], run: show("palette") },
    panel: {
      group,
      label: "Show or hide the panel",
      keys: ["Shift+P"],
      run: () => session.update({ sheet: !session.value.sheet }),
    },
    theme: { group, label: "Dark or light", keys: ["Shift+D"], run: toggleTheme },
    help: { group, label: "Keys", keys: ["?", "F1"], run: show("help") },
  };
}
