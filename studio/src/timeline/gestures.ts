/** What the pointer does on the timeline: scrub, mark, drag edges, seams, transitions, blocks and keys. */

import { type App, duration } from "../app/app";
import { changePose, changeTarget, shiftTarget } from "../project/asks";
import { type Project, begins, clamp, length, newId, round } from "../project/model";
import { halfSeconds, snap } from "../project/snap";
import { moveSeam, moveSegment, resizeSegment, setTransition, transitionOf } from "../project/timeline";
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
    gesture = begin(app, view, handle, event);
    root.setPointerCapture(event.pointerId);
    if (handle.dataset.drag !== "block" && handle.dataset.drag !== "second") event.preventDefault();
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
    if (block?.dataset.id) view.edit(block.dataset.id, block.dataset.drag === "second");
  });
  root.addEventListener(
    "wheel",
    (event) => {
      if (!event.ctrlKey) return;
      event.preventDefault();
      view.zoom(event.deltaY < 0 ? 1.15 : 1 / 1.15);
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
      app.session.update({ selection: { kind: "pose", id } });
      const pose = app.project.value.people[who]?.poses.find((one) => one.id === id);
      return edits("move a pose", pose?.time ?? 0, (project, time) =>
        changePose(project, who, id, { time: clamp(time, 0, length(project)) }),
      );
    }
    default:
      return reordering(app, view, handle, id, event.clientX);
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
  ]);
  return [...halfSeconds(duration(app) + 2), ...begins(value.segments), time, ...asked];
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

/** The block goes with the pointer, and lands between the others. */
function reordering(app: App, view: TimelineView, handle: HTMLElement, id: string, from: number): Gesture {
  app.session.update({ selection: { kind: "segment", id } });
  let isDragged = false;
  return {
    move(_, event) {
      isDragged ||= Math.abs(event.clientX - from) > DRAGGED;
      if (!isDragged) return;
      handle.classList.add("dragged");
      handle.style.transform = `translateX(${event.clientX - from}px)`;
    },
    end(time) {
      handle.classList.remove("dragged");
      handle.style.transform = "";
      if (!isDragged) return;
      app.project.change("move a block", (old) => moveSegment(old, id, landing(old, id, time)));
      view.render();
    },
  };
}

/** The place among the other blocks whose middle is behind `time`. */
export function landing(project: Project, id: string, time: number): number {
  const at = begins(project.segments);
  let place = 0;
  project.segments.forEach((one, index) => {
    if (one.id !== id && (at[index]! + at[index + 1]!) / 2 < time) place += 1;
  });
  return place;
}
