/** Everything that can be done, with its words and its keys: what buttons, menus, keys, the palette and `?` share. */

import { removePoint, removePose, removeTarget } from "../project/constraints";
import { addMarker, nextStop, removeMarker } from "../project/markers";
import { FPS, begins, clamp, round, toFrame } from "../project/model";
import {
  addSegment,
  moveSegments,
  pasteSegments,
  removeSegments,
  resizeSegment,
  setPeople,
  splitSegment,
} from "../project/timeline";
import { newLook, newSmoothing, newTrack, writeTrack } from "../panels/tracks";
import { removeTrack } from "../project/tracks";
import type { Stage } from "../stage/stage";
import { type App, duration } from "./app";
import { type Clipboard, copied, readClipboard } from "./clipboard";
import type { Deeds } from "./deeds";
import type { Drawer } from "./drawing";
import type { Files } from "./files";
import type { Live } from "./live";
import { exports, projects, windows } from "./projectActions";
import { ALSO } from "./synonyms";
import type { Projects } from "./projects";
import { NOTHING, type Session, type Tool, blocksChosen, chosenBlocks } from "./session";

export interface Action {
  readonly group: "Play" | "Blocks" | "Timeline" | "On the stage" | "Takes" | "Export" | "Project";
  readonly label: string;
  /** As `keyOf` writes them. */
  readonly keys: readonly string[];
  readonly run: () => void;
  /** More about it, for menus. */
  readonly note?: string;
  /** Whether it can be done at the moment, where that is not always so. */
  readonly isThere?: () => boolean;
  /** Other words for it, by which the palette finds it. */
  readonly also?: string;
}

/** Poses that are put between two. */
export const FILLED = 3;

export type Actions = Readonly<Record<string, Action>>;

export interface Parts {
  readonly app: App;
  readonly drawer: Drawer;
  readonly deeds: Deeds;
  readonly files: Files;
  readonly projects: Projects;
  readonly stage: Stage;
  readonly toggleTheme: () => void;
  readonly editWords: (id: string) => void;
  readonly live: Live;
  readonly choose: () => void;
  readonly zoom: (factor: number) => void;
  /** Show all of the timeline. */
  readonly fit: () => void;
}

export function actions(parts: Parts): Actions {
  const groups = [play, blocks, timeline, stage, takes, exports, projects, windows].map((group) => group(parts));
  const all = groups.flatMap((group) => Object.entries(group));
  const keys = all.flatMap(([, action]) => action.keys);
  const twice = [all.map(([name]) => name), keys].flatMap((each) => each.filter((one, at) => each.indexOf(one) < at));
  if (twice.length) throw new Error(`two actions have the name or key ${twice.join(", ")}`);
  return Object.fromEntries(all.map(([name, action]) => [name, { ...action, also: ALSO[name] ?? "" }]));
}

function play({ app }: Parts): Actions {
  const { session } = app;
  const go = (time: number) => session.update({ time: clamp(time, 0, duration(app)), playing: false });
  const rate = (factor: number) => session.update({ rate: clamp(session.value.rate * factor, 0.125, 4) });
  const group = "Play" as const;
  return {
    play: {
      group,
      label: "Play or pause",
      keys: ["Space"],
      run: () => session.update({ playing: !session.value.playing }),
    },
    back: { group, label: "One frame back", keys: ["ArrowLeft"], run: () => go(toFrame(session.value.time) - 1 / FPS) },
    on: { group, label: "One frame on", keys: ["ArrowRight"], run: () => go(toFrame(session.value.time) + 1 / FPS) },
    secondBack: { group, label: "One second back", keys: ["Shift+ArrowLeft"], run: () => go(session.value.time - 1) },
    secondOn: { group, label: "One second on", keys: ["Shift+ArrowRight"], run: () => go(session.value.time + 1) },
    first: { group, label: "To the beginning", keys: ["Home"], run: () => go(0) },
    last: { group, label: "To the end", keys: ["End"], run: () => go(duration(app)) },
    slower: { group, label: "Half as fast", keys: ["["], run: () => rate(0.5) },
    faster: { group, label: "Twice as fast", keys: ["]"], run: () => rate(2) },
    repeat: {
      group,
      label: "Play again and again",
      keys: ["Y"],
      run: () => session.update({ repeat: !session.value.repeat }),
    },
  };
}

function blocks({ app, editWords }: Parts): Actions {
  const { project, session } = app;
  const group = "Blocks" as const;
  const under = () => {
    const at = begins(project.value.segments);
    const { segments } = project.value;
    return (segments.find((_, index) => session.value.time < at[index + 1]!) ?? segments.at(-1)!).id;
  };
  const chosen = () => {
    const ids = chosenBlocks(session.value.selection);
    return ids.length ? ids : [under()];
  };
  const indexOf = (id: string) => project.value.segments.findIndex((one) => one.id === id);
  const step = (by: number, more = false) => {
    const { segments } = project.value;
    const ids = chosenBlocks(session.value.selection);
    const from = indexOf(ids[0] ?? under());
    const next = segments[clamp(from + (ids.length ? by : 0), 0, segments.length - 1)]!;
    session.update({ selection: blocksChosen([next.id, ...(more ? ids.filter((id) => id !== next.id) : [])]) });
  };
  const stretch = (by: number) => {
    const ids = chosen();
    const change = (old: typeof project.value) =>
      ids.reduce((now, id) => {
        const index = now.segments.findIndex((one) => one.id === id);
        return resizeSegment(now, id, begins(now.segments)[index + 1]! + by);
      }, old);
    project.change("change a length", change, { merge: `length:${ids.join()}`, typed: true });
  };
  const reorder = (by: number) => {
    const ids = chosen();
    const first = Math.min(...ids.map(indexOf));
    project.change("move a block", (old) => moveSegments(old, ids, first + by));
  };
  const paste = (found: Clipboard, to: number, label: string) => {
    let fresh: string[] = [];
    project.change(label, (old) => {
      const [next, ids] = pasteSegments(old, found, to);
      fresh = ids;
      return next;
    });
    session.update({ selection: blocksChosen(fresh) });
  };
  const copy = () => copied(project.value.segments.filter((one) => chosen().includes(one.id)));
  const behind = () => Math.max(...chosen().map(indexOf)) + 1;
  return {
    add: {
      group,
      label: "Add a block",
      keys: ["A"],
      run: () => {
        project.change("add a block", (old) => addSegment(old));
        editWords(project.value.segments.at(-1)!.id);
      },
    },
    write: {
      group,
      label: "Write in the block",
      keys: ["Enter"],
      run: () => {
        const { selection } = session.value;
        if (selection.kind === "track") writeTrack(app, selection.id);
        else editWords(chosen()[0]!);
      },
    },
    track: { group, label: "Arms or legs do something of their own", keys: ["Shift+A"], run: () => newTrack(app) },
    previous: { group, label: "Block before", keys: ["ArrowUp"], run: () => step(-1) },
    next: { group, label: "Block behind", keys: ["ArrowDown"], run: () => step(1) },
    morePrevious: { group, label: "Select the block before, too", keys: ["Shift+ArrowUp"], run: () => step(-1, true) },
    moreNext: { group, label: "Select the block behind, too", keys: ["Shift+ArrowDown"], run: () => step(1, true) },
    all: {
      group,
      label: "Select all blocks",
      keys: ["Ctrl+A"],
      run: () => session.update({ selection: blocksChosen(project.value.segments.map((one) => one.id)) }),
    },
    shorter: { group, label: "Shorter by a quarter second", keys: [","], run: () => stretch(-0.25) },
    longer: { group, label: "Longer by a quarter second", keys: ["."], run: () => stretch(0.25) },
    earlier: { group, label: "Move the block to the left", keys: ["Alt+ArrowLeft"], run: () => reorder(-1) },
    later: { group, label: "Move the block to the right", keys: ["Alt+ArrowRight"], run: () => reorder(1) },
    split: {
      group,
      label: "Split at the playhead",
      keys: ["S"],
      run: () => project.change("split a block", (old) => splitSegment(old, session.value.time)),
    },
    duplicate: {
      group,
      label: "Duplicate the block",
      keys: ["D"],
      run: () =>
        paste(
          project.value.segments.filter((one) => chosen().includes(one.id)),
          behind(),
          "duplicate a block",
        ),
    },
    copy: { group, label: "Copy blocks", keys: ["Ctrl+C"], run: copy },
    cut: {
      group,
      label: "Cut blocks",
      keys: ["Ctrl+X"],
      run: () => {
        copy();
        const ids = chosen();
        session.update({ selection: NOTHING });
        project.change("cut blocks", (old) => removeSegments(old, ids));
      },
    },
    paste: {
      group,
      label: "Paste blocks behind the selected one",
      keys: ["Ctrl+V"],
      isThere: () => readClipboard().length > 0,
      run: () => {
        const found = readClipboard();
        if (found.length) paste(found, behind(), "paste blocks");
      },
    },
    remove: { group, label: "Delete what is selected", keys: ["Delete", "Backspace"], run: () => removeSelected(app) },
  };
}

function timeline({ app, zoom, fit }: Parts): Actions {
  const { project, session } = app;
  const group = "Timeline" as const;
  const stop = (by: 1 | -1) =>
    session.update({ time: clamp(nextStop(project.value, session.value.time, by), 0, duration(app)), playing: false });
  return {
    curves: {
      group,
      label: "Curves: how high and fast a joint is",
      keys: ["Shift+C"],
      run: () => session.update({ curves: !session.value.curves }),
    },
    fit: { group, label: "Show the whole timeline", keys: ["F"], run: fit },
    zoomIn: { group, label: "Zoom in", keys: ["+", "="], run: () => zoom(1.4) },
    zoomOut: { group, label: "Zoom out", keys: ["-"], run: () => zoom(1 / 1.4) },
    marker: {
      group,
      label: "Put a marker at the playhead",
      keys: ["Shift+M"],
      run: () => {
        project.change("put a marker", (old) => addMarker(old, session.value.time));
        const at = toFrame(session.value.time);
        const found = project.value.markers.find((one) => Math.abs(one.time - at) < 1e-3);
        if (found) session.update({ selection: { kind: "marker", id: found.id } });
      },
    },
    stopBefore: { group, label: "To the seam or marker before", keys: ["Ctrl+ArrowLeft"], run: () => stop(-1) },
    stopBehind: { group, label: "To the seam or marker behind", keys: ["Ctrl+ArrowRight"], run: () => stop(1) },
    snapping: {
      group,
      label: "Snap or not",
      keys: ["M"],
      run: () => session.update({ snapping: !session.value.snapping }),
    },
    overwriting: {
      group,
      label: "Moved blocks push the others aside, or lie over them",
      keys: ["Shift+O"],
      run: () => session.update({ overwriting: !session.value.overwriting }),
    },
  };
}

function removeSelected({ project, session }: App): void {
  const { selection, person } = session.value;
  session.update({ selection: NOTHING });
  const ids = chosenBlocks(selection);
  if (ids.length)
    project.change(ids.length > 1 ? "delete blocks" : "delete a block", (old) => removeSegments(old, ids));
  if (selection.kind === "marker") project.change("delete a marker", (old) => removeMarker(old, selection.id));
  if (selection.kind === "target") project.change("delete a target", (old) => removeTarget(old, person, selection.id));
  if (selection.kind === "pose") project.change("delete a pose", (old) => removePose(old, person, selection.id));
  if (selection.kind === "track")
    project.change("delete words of a part", (old) => removeTrack(old, person, selection.id));
  if (selection.kind === "point") project.change("delete a point", (old) => removePoint(old, person, selection.index));
}

function stage({ app, deeds, live, stage }: Parts): Actions {
  const { project, session } = app;
  const group = "On the stage" as const;
  const tool = (name: Tool) => () =>
    session.update({
      tool: session.value.tool === name ? "select" : name,
      playing: name === "select" && session.value.playing,
    });
  const flip = (key: "follow" | "ghosts" | "around" | "trails") => () =>
    session.update({ [key]: !session.value[key] } as Partial<Session>);
  return {
    select: { group, label: "Select and look around", keys: ["V"], run: tool("select") },
    path: { group, label: "Draw a path", keys: ["P"], run: tool("path") },
    target: { group, label: "Drag joints", keys: ["T"], run: tool("target") },
    pose: { group, label: "Keyframe the pose at hand", keys: ["O"], run: () => deeds.keyframe() },
    look: { group, label: "Look at a point, or at the other person", keys: ["Shift+L"], run: () => newLook(app) },
    smooth: { group, label: "Smooth what trembles", keys: ["Shift+N"], run: () => newSmoothing(app) },
    copyPose: { group, label: "Copy the pose", keys: ["Alt+C"], run: () => deeds.copyPose() },
    pastePose: { group, label: "Paste the pose at the playhead", keys: ["Alt+V"], run: () => deeds.pastePose() },
    mirrorPose: { group, label: "Mirror the pose", keys: ["Alt+M"], run: () => deeds.mirrorPose() },
    fillPoses: {
      group,
      label: "Poses between the selected one and the next",
      keys: ["Alt+I"],
      run: () => deeds.fillPoses(FILLED),
    },
    pin: { group, label: "Pin the joint of a pose, or let it go", keys: ["Alt+P"], run: () => stage.targets.pin() },
    live: { group, label: "Live: steer somebody who moves", keys: ["J"], run: () => live.toggle() },
    follow: { group, label: "Follow with the camera", keys: ["C"], run: flip("follow") },
    above: { group, label: "Look from above", keys: ["X"], run: () => stage.fromAbove() },
    ghosts: { group, label: "Ghosts of other takes", keys: ["H"], run: flip("ghosts") },
    frameAll: { group, label: "Show the whole motion", keys: ["Shift+F"], run: () => stage.frameAll() },
    around: { group, label: "Ghosts before and behind the playhead", keys: ["Shift+G"], run: flip("around") },
    trails: { group, label: "Trails of hips, hands and feet", keys: ["I"], run: flip("trails") },
    views: {
      group,
      label: "Front and side beside it, front and above, or neither",
      keys: ["Shift+X"],
      run: () =>
        session.update({ views: ({ null: "side", side: "above", above: null } as const)[`${session.value.views}`] }),
    },
    meeting: {
      group,
      label: "To the next meeting of hands of two people, to move it",
      keys: ["Shift+T"],
      isThere: () => project.value.people.length > 1,
      run: () => stage.meetings.next(),
    },
    backdrop: {
      group,
      label: "A colour or a picture behind the people",
      keys: ["Shift+B"],
      run: () => session.update({ dialog: "backdrop" }),
    },
    people: {
      group,
      label: "One person or two",
      keys: ["U"],
      run: () => project.change("change the people", (old) => setPeople(old, old.people.length === 1 ? 2 : 1)),
    },
    person: {
      group,
      label: "Work on the other person",
      keys: ["Q"],
      run: () =>
        session.update({ person: (session.value.person + 1) % project.value.people.length, selection: NOTHING }),
    },
  };
}

function takes({ app, deeds, drawer }: Parts): Actions {
  const { project, session } = app;
  const group = "Takes" as const;
  const next = () => {
    const { fan, clips } = session.value;
    if (!fan && clips.length > 1)
      project.change("keep another take", (old) => ({ ...old, kept: (old.kept + 1) % clips.length }));
  };
  return {
    draw: { group, label: "Draw again with another seed", keys: ["R"], run: () => drawer.again() },
    drawAll: { group, label: "Draw all blocks, none kept", keys: ["Shift+R"], run: () => drawer.all() },
    four: {
      group,
      label: "Four takes side by side, or one",
      keys: ["G"],
      run: () => {
        const count = project.value.count === 4 ? 1 : 4;
        session.update({ sideBySide: count === 4 });
        project.change(count === 4 ? "draw four takes" : "draw one take", (old) => ({
          ...old,
          count,
          takes: count === 1 ? old.takes.slice(old.kept, old.kept + 1) : old.takes,
          kept: count === 1 ? 0 : old.kept,
          seed: count === 1 ? (old.takes[old.kept]?.seed ?? old.seed) : old.seed,
        }));
      },
    },
    beside: {
      group,
      label: "Side by side or one of them",
      keys: ["B"],
      run: () => session.update({ sideBySide: !session.value.sideBySide }),
    },
    another: { group, label: "Keep the next take", keys: ["K"], run: next },
    freeze: { group, label: "Freeze the marked stretch or the block", keys: ["Z"], run: () => void deeds.freeze() },
    unfreeze: { group, label: "Unfreeze everything", keys: ["Shift+Z"], run: () => deeds.unfreeze() },
    predict: { group, label: "What could come next", keys: ["N"], run: () => void deeds.predict() },
    loop: { group, label: "Make it a loop", keys: ["L"], run: () => void deeds.loop() },
    aside: { group, label: "Put the take aside", keys: ["W"], run: () => deeds.keepAside() },
    escape: { group, label: "Leave, stop, close", keys: ["Escape"], run: () => leave(app, drawer) },
  };
}

function leave({ session }: App, drawer: Drawer): void {
  const { welcome, sheet, fan, range, drawing } = session.value;
  if (welcome) session.update({ welcome: false });
  else if (sheet) session.update({ sheet: false });
  else if (fan) session.update({ fan: null });
  else if (drawing) drawer.stop();
  else session.update({ tool: "select", selection: NOTHING, range: range && null, error: null });
}

/** Arrow keys move what the tool holds: metres over the floor, or up and down. */
export function nudged(event: KeyboardEvent, { app, stage }: Parts): boolean {
  const { tool } = app.session.value;
  if (tool === "select" || event.ctrlKey || event.metaKey || event.altKey) return false;
  const size = tool === "path" ? (event.shiftKey ? 0.1 : 0.5) : event.shiftKey ? 0.01 : 0.05;
  const ways: Record<string, readonly [number, number, number]> = {
    ArrowLeft: [size, 0, 0],
    ArrowRight: [-size, 0, 0],
    ArrowUp: [0, 0, size],
    ArrowDown: [0, 0, -size],
    PageUp: [0, size, 0],
    PageDown: [0, -size, 0],
  };
  const way = ways[event.key]?.map(round) as [number, number, number] | undefined;
  if (tool === "path" && event.key === "Enter") stage.path.placePoint();
  else if (!way) return false;
  else if (tool === "path") stage.path.nudge(way[0], way[2]);
  else if (tool === "meeting") stage.meetings.nudge(...way);
  else stage.targets.nudge(...way);
  return true;
}
