/** Everything that can be done, with its words and its key. `?` lists it. */

import { SUFFIX } from "../project/file";
import { removePoint, removePose, removeTarget } from "../project/asks";
import { FPS, begins, clamp, round, toFrame } from "../project/model";
import {
  addSegment,
  duplicateSegment,
  moveSegment,
  removeSegment,
  resizeSegment,
  setPeople,
  splitSegment,
} from "../project/timeline";
import type { Stage } from "../stage/stage";
import { type App, duration } from "./app";
import type { Deeds } from "./deeds";
import type { Drawer } from "./drawing";
import type { Files } from "./files";
import type { Live } from "./live";
import { NOTHING, type Session, type Tool } from "./session";

export interface Action {
  readonly group: "Play" | "Blocks" | "On the stage" | "Takes" | "Project";
  readonly label: string;
  /** As `keyOf` writes them. */
  readonly keys: readonly string[];
  readonly run: () => void;
}

export type Actions = Readonly<Record<string, Action>>;

export interface Parts {
  readonly app: App;
  readonly drawer: Drawer;
  readonly deeds: Deeds;
  readonly files: Files;
  readonly stage: Stage;
  readonly toggleTheme: () => void;
  readonly editWords: (id: string) => void;
  readonly live: Live;
  readonly choose: () => void;
  readonly zoom: (factor: number) => void;
}

export function actions(parts: Parts): Actions {
  return { ...play(parts), ...blocks(parts), ...stage(parts), ...takes(parts), ...project(parts) };
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

function blocks({ app, editWords, zoom }: Parts): Actions {
  const { project, session } = app;
  const group = "Blocks" as const;
  const selected = () => {
    const { selection, time } = session.value;
    const { segments } = project.value;
    if (selection.kind === "segment") return selection.id;
    const at = begins(segments);
    return (segments.find((_, index) => time < at[index + 1]!) ?? segments.at(-1)!).id;
  };
  const step = (by: number) => {
    const { segments } = project.value;
    const index = segments.findIndex((one) => one.id === selected());
    const isOn = session.value.selection.kind === "segment";
    const next = segments[clamp(index + (isOn ? by : 0), 0, segments.length - 1)]!;
    session.update({ selection: { kind: "segment", id: next.id } });
  };
  const stretch = (by: number) => {
    const id = selected();
    const index = project.value.segments.findIndex((one) => one.id === id);
    const end = begins(project.value.segments)[index + 1]!;
    project.change("change a length", (old) => resizeSegment(old, id, end + by), {
      merge: `length:${id}`,
      typed: true,
    });
  };
  const reorder = (by: number) => {
    const id = selected();
    const index = project.value.segments.findIndex((one) => one.id === id);
    project.change("move a block", (old) => moveSegment(old, id, index + by));
  };
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
    write: { group, label: "Write in the block", keys: ["Enter"], run: () => editWords(selected()) },
    previous: { group, label: "Block before", keys: ["ArrowUp"], run: () => step(-1) },
    next: { group, label: "Block behind", keys: ["ArrowDown"], run: () => step(1) },
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
      run: () => project.change("duplicate a block", (old) => duplicateSegment(old, selected())),
    },
    remove: { group, label: "Delete what is selected", keys: ["Delete", "Backspace"], run: () => removeSelected(app) },
    zoomIn: { group, label: "Zoom in", keys: ["+", "="], run: () => zoom(1.4) },
    zoomOut: { group, label: "Zoom out", keys: ["-"], run: () => zoom(1 / 1.4) },
    snapping: {
      group,
      label: "Snap or not",
      keys: ["M"],
      run: () => session.update({ snapping: !session.value.snapping }),
    },
  };
}

function removeSelected({ project, session }: App): void {
  const { selection, person } = session.value;
  session.update({ selection: NOTHING });
  if (selection.kind === "segment") project.change("delete a block", (old) => removeSegment(old, selection.id));
  if (selection.kind === "target") project.change("delete a target", (old) => removeTarget(old, person, selection.id));
  if (selection.kind === "pose") project.change("delete a pose", (old) => removePose(old, person, selection.id));
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
  const flip = (key: "follow" | "ghosts" | "trails") => () =>
    session.update({ [key]: !session.value[key] } as Partial<Session>);
  return {
    select: { group, label: "Select and look around", keys: ["V"], run: tool("select") },
    path: { group, label: "Draw a path", keys: ["P"], run: tool("path") },
    target: { group, label: "Drag joints", keys: ["T"], run: tool("target") },
    pose: { group, label: "Keyframe the pose at hand", keys: ["O"], run: () => deeds.keyframe() },
    live: { group, label: "Live: steer somebody who moves", keys: ["J"], run: () => live.toggle() },
    follow: { group, label: "Camera follows", keys: ["C"], run: flip("follow") },
    above: { group, label: "Look from above", keys: ["X"], run: () => stage.fromAbove() },
    ghosts: { group, label: "Ghosts of other takes", keys: ["H"], run: flip("ghosts") },
    trails: { group, label: "Trails", keys: ["I"], run: flip("trails") },
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
    freeze: { group, label: "Freeze the marked stretch or the block", keys: ["F"], run: () => void deeds.freeze() },
    unfreeze: { group, label: "Unfreeze everything", keys: ["Shift+F"], run: () => deeds.unfreeze() },
    predict: { group, label: "What could come next", keys: ["N"], run: () => void deeds.predict() },
    loop: { group, label: "Make it a loop", keys: ["L"], run: () => void deeds.loop() },
    aside: { group, label: "Put the take aside", keys: ["W"], run: () => deeds.keepAside() },
    escape: { group, label: "Leave, stop, close", keys: ["Escape"], run: () => leave(app, drawer) },
  };
}

function leave({ session }: App, drawer: Drawer): void {
  const { help, fan, range, drawing } = session.value;
  if (help) session.update({ help: false });
  else if (fan) session.update({ fan: null });
  else if (drawing) drawer.stop();
  else session.update({ tool: "select", selection: NOTHING, range: range && null, error: null });
}

function project({ app, files, choose, toggleTheme }: Parts): Actions {
  const { project: history, session } = app;
  const group = "Project" as const;
  return {
    undo: { group, label: "Undo", keys: ["Ctrl+Z"], run: () => void history.undo() },
    redo: { group, label: "Redo", keys: ["Ctrl+Shift+Z", "Ctrl+Y"], run: () => void history.redo() },
    open: { group, label: "Open files", keys: ["Ctrl+O"], run: choose },
    save: {
      group,
      label: `Save the project as a file (${SUFFIX})`,
      keys: ["Ctrl+S"],
      run: () => void files.export("project"),
    },
    export: { group, label: "Export BVH", keys: ["E"], run: () => void files.export("bvh") },
    exportGlb: { group, label: "Export GLB", keys: ["Shift+E"], run: () => void files.export("glb") },
    share: { group, label: "Share as a web page", keys: ["Ctrl+E"], run: () => void files.export("html") },
    exportYaml: { group, label: "Export the timeline as YAML", keys: ["Alt+E"], run: () => void files.export("yaml") },
    theme: { group, label: "Dark or light", keys: ["Shift+D"], run: toggleTheme },
    help: { group, label: "Keys", keys: ["?", "F1"], run: () => session.update({ help: !session.value.help }) },
  };
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
  if (tool === "path" && event.key === "Enter") stage.path.put();
  else if (!way) return false;
  else if (tool === "path") stage.path.nudge(way[0], way[2]);
  else stage.targets.nudge(...way);
  return true;
}
