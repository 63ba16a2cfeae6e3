/** What the pointer does on the timeline: scrub, mark, drag edges, seams, transitions, blocks and keys. */

import { type App, duration } from "../app/app";
import { NOTHING, blocksChosen, chosenBlocks } from "../app/session";
import { changePose, changeTarget, shiftTarget } from "../project/constraints";
import { changeMarker } from "../project/markers";
import { type Project, SHORTEST, begins, clamp, length, newId, round } from "../project/model";
import { writeTrack } from "../panels/tracks";
import { halfSeconds, snap } from "../project/snap";
import { layOver, moveSeam, moveSegments, resizeSegment, setTransition, transitionOf } from "../project/timeline";
import { changeTrack, shiftTrack, trackOf } from "../project/tracks";
import type { TimelineView } from "./view";

/** Pixels within which a time catches on a mark, and that a block is moved before it is being dragged. */
const REACH = 8;
const DRAGGED = 6;

interface Gesture {
  move(time: number, event: PointerEvent): void;
  end(time: number, event: PointerEvent): void;
}

export function listen(app: App, view: TimelineView, root: HTMLElement): void {
  let gesture: Gesture | null = null;
  root.addEventListener("pointerdown", (event) => {
    const handle = (event.target as Element).closest<HTMLElement>("[data-drag]");
    if (!handle || event.button !== 0 || event.target instanceof HTMLInputElement) return;
    if ((event.target as Element).closest("button:not([data-drag])")) return;
    gesture = begin(app, view, handle, event);
    root.setPointerCapture(event.pointerId);
    const takesFocus = ["block", "second", "marker"].includes(handle.dataset.drag!);
    if (!takesFocus || event.ctrlKey || event.metaKey || event.shiftKey) event.preventDefault();
  });
  root.addEventListener("pointermove", (event) => gesture?.move(view.timeAt(event.clientX), event));
  const end = (event: PointerEvent) => {
    gesture?.end(view.timeAt(event.clientX), event);
    gesture = null;
  };
  root.addEventListener("pointerup", end);
  root.addEventListener("pointercancel", end);
  // Clicks go to whoever captured the pointer, not to the block under it.
  root.addEventListener("dblclick", (event) => {
    const block = document.elementFromPoint(event.clientX, event.clientY)?.closest<HTMLElement>(".block");
    const track = document.elementFromPoint(event.clientX, event.clientY)?.closest<HTMLElement>(".own");
    if (track) writeTrack(app, track.dataset.id!);
    if (block?.dataset.id) view.edit(block.dataset.id, block.dataset.drag === "second");
  });
  root.addEventListener(
    "wheel",
    (event) => {
      if (!event.ctrlKey) return;
      event.preventDefault();
      view.zoom(event.deltaY < 0 ? 1.15 : 1 / 1.15, event.clientX);
    },
    { passive: false },
  );
}

function begin(app: App, view: TimelineView, handle: HTMLElement, event: PointerEvent): Gesture {
  const id = handle.dataset.id ?? "";
  const who = app.session.value.person;
  const caught = (time: number, now: PointerEvent) =>
    snap(time, marks(app), REACH / view.scale, now.altKey || !app.session.value.snapping);
  const at = begins(app.project.value.segments);
  const index = app.project.value.segments.findIndex((one) => one.id === id);
  /** An edit that follows the pointer as far from it as the edge was that it took hold of. */
  const edits = (label: string, edge: number, edit: (project: Project, time: number) => Project) => {
    const offset = view.timeAt(event.clientX) - edge;
    const follow = (time: number, now: PointerEvent) => caught(time - offset, now);
    return editing(app, label, follow, edit);
  };
  switch (handle.dataset.drag) {
    case "ruler":
      return event.shiftKey
        ? marking(app, caught, view.timeAt(event.clientX))
        : scrubbing(app, view.timeAt(event.clientX));
    case "end":
      return edits("change a length", at[index + 1]!, (project, time) => resizeSegment(project, id, time));
    case "seam":
      return edits("move a seam", at[index + 1]!, (project, time) => moveSeam(project, id, time));
    case "transition": {
      const seam = at[index + 1]!;
      const edge = seam + transitionOf(app.project.value, index) / 2;
      return edits("change a transition", edge, (project, time) =>
        setTransition(project, id, round(Math.abs(time - seam) * 2)),
      );
    }
    case "target":
    case "until": {
      app.session.update({ selection: { kind: "target", id }, ...jointOf(app, id) });
      const target = app.project.value.people[who]?.targets.find((one) => one.id === id);
      if (handle.dataset.drag === "target") {
        return edits("move a target", target?.time ?? 0, (project, time) => shiftTarget(project, who, id, time));
      }
      return edits("pin a target", target?.until ?? 0, (project, time) =>
        changeTarget(project, who, id, { until: clamp(time, 0, length(project)) }),
      );
    }
    case "pose": {
      const pose = app.project.value.people[who]?.poses.find((one) => one.id === id);
      app.session.update({ selection: { kind: "pose", id }, time: pose?.time ?? 0, playing: false });
      return edits("move a pose", pose?.time ?? 0, (project, time) =>
        changePose(project, who, id, { time: clamp(time, 0, length(project)) }),
      );
    }
    case "track":
    case "track-from":
    case "track-until": {
      app.session.update({ selection: { kind: "track", id } });
      const { from = 0, until = 0 } = trackOf(app.project.value, who, id) ?? {};
      if (handle.dataset.drag === "track")
        return edits("move words of a part", from, (project, time) => shiftTrack(project, who, id, time));
      const [edge, name] = handle.dataset.drag === "track-from" ? [from, "from"] : [until, "until"];
      return edits("stretch words of a part", edge, (project, time) =>
        changeTrack(project, who, id, name === "from" ? { from: Math.min(time, until - SHORTEST) } : { until: time }),
      );
    }
    case "marker": {
      app.session.update({ selection: { kind: "marker", id } });
      const marker = app.project.value.markers.find((one) => one.id === id);
      return edits("move a marker", marker?.time ?? 0, (project, time) => changeMarker(project, id, { time }));
    }
    case "band":
      return event.pointerType === "touch" ? panning(view, event) : framing(app, view, event);
    default:
      return chosenBy(event, app, id) ? STILL : moving(app, view, root(handle), id, event, caught);
  }
}

/** A selected target brings its joint and its time to the stage. */
function jointOf(app: App, id: string): { joint?: number; time?: number } {
  const target = app.project.value.people[app.session.value.person]?.targets.find((one) => one.id === id);
  return target ? { joint: target.joint, time: target.time } : {};
}

function marks(app: App): number[] {
  const { value } = app.project;
  const { time } = app.session.value;
  const asked = value.people.flatMap((person) => [
    ...person.targets.map((one) => one.time),
    ...person.poses.map((one) => one.time),
    ...person.tracks.flatMap((one) => [one.from, one.until]),
  ]);
  const marked = value.markers.map((one) => one.time);
  return [...halfSeconds(duration(app) + 2), ...begins(value.segments), time, ...asked, ...marked];
}

function scrubbing(app: App, start: number): Gesture {
  const go = (time: number) => app.session.update({ time: clamp(time, 0, duration(app)), playing: false });
  go(start);
  return { move: go, end: go };
}

function marking(app: App, caught: (time: number, event: PointerEvent) => number, start: number): Gesture {
  const mark = (time: number, event: PointerEvent) => {
    const [from, to] = [caught(start, event), caught(time, event)].map((one) => clamp(one, 0, duration(app)));
    app.session.update({ range: from === to ? null : [Math.min(from!, to!), Math.max(from!, to!)] });
  };
  return { move: mark, end: mark };
}

/** Every move is a draft of one step of undo; the release makes it real. */
function editing(
  app: App,
  label: string,
  caught: (time: number, event: PointerEvent) => number,
  edit: (project: Project, time: number) => Project,
): Gesture {
  const merge = `drag:${newId()}`;
  let moved = false;
  return {
    move(time, event) {
      moved = true;
      app.project.change(label, (old) => edit(old, caught(time, event)), { merge, draft: true });
    },
    end(time, event) {
      if (moved) app.project.change(label, (old) => edit(old, caught(time, event)), { merge });
    },
  };
}

const STILL: Gesture = { move: () => undefined, end: () => undefined };

/** With Ctrl a block is selected besides, or no more; with Shift, all up to it. True: the press was for that alone. */
function chosenBy(event: PointerEvent, app: App, id: string): boolean {
  const { selection } = app.session.value;
  const ids = chosenBlocks(selection);
  if (event.ctrlKey || event.metaKey) {
    const left = ids.includes(id) ? ids.filter((one) => one !== id) : [id, ...ids];
    app.session.update({ selection: blocksChosen(left) });
    return true;
  }
  const all = app.project.value.segments.map((one) => one.id);
  const [from, to] = [all.indexOf(ids[0] ?? id), all.indexOf(id)];
  if (!event.shiftKey || from === to) return false;
  const between = all.slice(Math.min(from, to), Math.max(from, to) + 1);
  app.session.update({ selection: blocksChosen([ids[0]!, ...between.filter((one) => one !== ids[0])]) });
  return true;
}

/** A frame drawn over the blocks selects those in it; a press beside them selects nothing. */
function framing(app: App, view: TimelineView, { clientX, clientY }: PointerEvent): Gesture {
  return {
    move: (_, event) => {
      const found = view.frame([clientX, clientY], [event.clientX, event.clientY]);
      const old = chosenBlocks(app.session.value.selection);
      if (found.join() !== old.join()) app.session.update({ selection: blocksChosen(found) });
    },
    end: (_, event) => {
      if (Math.hypot(event.clientX - clientX, event.clientY - clientY) < DRAGGED)
        app.session.update({ selection: NOTHING });
      view.frame(null);
    },
  };
}

/** A finger moves the timeline. */
function panning(view: TimelineView, { clientX }: PointerEvent): Gesture {
  const start = view.scroll.scrollLeft;
  const go = (_: number, event: PointerEvent) => (view.scroll.scrollLeft = start + clientX - event.clientX);
  return { move: go, end: () => undefined };
}

/** Blocks go with the pointer, and land between the others or over them. */
function moving(
  app: App,
  view: TimelineView,
  root: HTMLElement,
  id: string,
  pressed: PointerEvent,
  caught: (time: number, event: PointerEvent) => number,
): Gesture {
  const chosen = chosenBlocks(app.session.value.selection);
  const ids = chosen.includes(id) ? chosen : [id];
  if (ids.length === 1) app.session.update({ selection: { kind: "segment", id } });
  const { segments } = app.project.value;
  const at = begins(segments);
  const first = at[segments.findIndex((one) => ids.includes(one.id))]!;
  const seconds = segments.filter((one) => ids.includes(one.id)).reduce((sum, one) => sum + one.seconds, 0);
  const offset = view.timeAt(pressed.clientX) - first;
  const isOver = (event: PointerEvent) => app.session.value.overwriting !== event.shiftKey;
  let isDragged = false;
  const blocks = () => ids.flatMap((one) => [...root.querySelectorAll<HTMLElement>(`.block[data-id="${one}"]`)]);
  return {
    move(time, event) {
      isDragged ||= Math.abs(event.clientX - pressed.clientX) > DRAGGED;
      if (!isDragged) return;
      for (const one of blocks()) {
        one.classList.add("dragged");
        one.style.transform = `translateX(${event.clientX - pressed.clientX}px)`;
      }
      if (isOver(event)) view.mark(Math.max(caught(time - offset, event), 0), seconds);
      else view.mark(seam(app.project.value, ids, landing(app.project.value, ids, time)));
    },
    end(time, event) {
      for (const one of blocks()) {
        one.classList.remove("dragged");
        one.style.transform = "";
      }
      view.mark(null);
      if (!isDragged) return app.session.update({ selection: { kind: "segment", id } });
      app.project.change(ids.length > 1 ? "move blocks" : "move a block", (old) =>
        isOver(event)
          ? layOver(old, ids, caught(time - offset, event))
          : moveSegments(old, ids, landing(old, ids, time)),
      );
      view.render();
    },
  };
}

/** The place among the other blocks whose middle is behind `time`. */
export function landing(project: Project, ids: readonly string[], time: number): number {
  const at = begins(project.segments);
  let place = 0;
  project.segments.forEach((one, index) => {
    if (!ids.includes(one.id) && (at[index]! + at[index + 1]!) / 2 < time) place += 1;
  });
  return place;
}

/** The time, as the blocks lie now, before the one that is at `place` among those that are not moved. */
function seam(project: Project, ids: readonly string[], place: number): number {
  const at = begins(project.segments);
  const others = project.segments.flatMap((one, index) => (ids.includes(one.id) ? [] : [index]));
  return others[place] === undefined ? at.at(-1)! : at[others[place]]!;
}

function root(handle: HTMLElement): HTMLElement {
  return handle.closest<HTMLElement>(".content")!;
}
