/** The panel at the right: what is selected, what is asked, the takes and the clips. */

import type { Actions } from "../app/actions";
import { type App, shownClip } from "../app/app";
import type { Deeds } from "../app/deeds";
import { h, morph } from "../app/dom";
import { NOTHING } from "../app/session";
import { jointName } from "../body/skeleton";
import { changePoint, changeTarget, removePose, removeTarget, setPath, setSpeed } from "../project/asks";
import { UNMET, isMeasurable, pathMiss, poseMiss, targetMiss } from "../project/misses";
import { type Given, type Person, type Project, type Segment, begins, length, round } from "../project/model";
import { pathLength, timed } from "../project/path";
import type { Place } from "../project/places";
import {
  changeSegment,
  freezeRest,
  longestTransition,
  resizeSegment,
  setPeople,
  setTransition,
  write,
} from "../project/timeline";
import { clipsSection, fanSection, takesSection } from "./takes";
import { miss, numberField, section, textButton } from "./parts";

/** Centimetres beyond which a path counts as missed. */
const OFF_PATH = 15;

export function inspector(app: App, actions: Actions, deeds: Deeds, root: HTMLElement): void {
  const render = () => {
    const { value } = app.project;
    const { fan, person } = app.session.value;
    const who = Math.min(person, value.people.length - 1);
    const asked = stagePanels(app, value, value.people[who]!, who, actions);
    const isTool = app.session.value.tool !== "select";
    morph(
      root,
      fan
        ? [fanSection(app, deeds, fan)]
        : [
            ...(isTool ? asked : []),
            words(app, value),
            ...(isTool ? [] : asked),
            takesSection(app, value, actions),
            clipsSection(app, value, deeds),
          ],
    );
  };
  app.project.subscribe(render);
  app.session.subscribe((now, before) => {
    const keys = ["selection", "clips", "fan", "person", "tool", "sideBySide", "drawing", "error"] as const;
    if (keys.some((key) => now[key] !== before[key])) render();
  });
  render();
}

function words(app: App, project: Project): HTMLElement {
  const { selection } = app.session.value;
  const index = selection.kind === "segment" ? project.segments.findIndex((one) => one.id === selection.id) : -1;
  const one = project.segments[index];
  if (!one) {
    return section(
      "Motion",
      h(
        "p",
        { class: "quiet" },
        `${project.segments.length === 1 ? "One block" : `${project.segments.length} blocks`}, ${length(project).toFixed(2)} s. Select a block to change its words.`,
      ),
      h(
        "div",
        { class: "pair" },
        numberField(
          "Seed",
          project.seed,
          "",
          (seed) => app.project.change("change the seed", (old) => ({ ...old, seed: Math.round(seed ?? 0) })),
          { min: 0, max: 2 ** 31, step: 1 },
        ),
        peopleField(app, project),
      ),
      kept(project.given, () => app.project.change("drop what the file asked", (old) => ({ ...old, given: null }))),
    );
  }
  const two = project.people.length > 1;
  return section(
    `Block ${index + 1}`,
    area(app, one, false),
    two && area(app, one, true),
    wrong(app, "segment", one.id),
    kept(one.given, () =>
      app.project.change("drop what the file asked", (old) => changeSegment(old, one.id, { given: null })),
    ),
    h(
      "div",
      { class: "pair" },
      numberField(
        "Length",
        one.seconds,
        "s",
        (value) =>
          value !== null &&
          app.project.change("change a length", (old) =>
            resizeSegment(old, one.id, begins(old.segments)[index]! + value),
          ),
        { min: 0.2, max: 60 },
      ),
      index < project.segments.length - 1 &&
        numberField(
          "Transition",
          one.transition,
          "s",
          (value) => app.project.change("change a transition", (old) => setTransition(old, one.id, value)),
          { min: 0.05, max: longestTransition(project, index), empty: "auto" },
        ),
    ),
    h(
      "div",
      { class: "row" },
      textButton(
        "Draw only this block",
        () =>
          app.project.change("draw only this block", (old) => ({
            ...freezeRest({ ...old, only: null }, one.id),
            seed: old.seed + 1,
          })),
        {
          title: "The rest of the motion stays as it is",
          disabled: !project.takes.length || project.segments.length < 2,
        },
      ),
    ),
  );
}

/** What the server said about this part of the project. */
function wrong(app: App, kind: Place["kind"], id?: string): HTMLElement | false {
  const { error } = app.session.value;
  const isHere = error?.at?.kind === kind && (!id || !("id" in error.at) || error.at.id === id);
  return isHere && h("p", { class: "unmet" }, error.message);
}

/** What a timeline file asks besides, and a way to be rid of it. */
function kept(given: Given | null, drop: () => void): HTMLElement | null {
  if (!given) return null;
  const goal = typeof given.path === "object" ? Object.keys(given.path ?? {}) : [];
  const names = [...Object.keys(given).filter((key) => key !== "path"), ...goal].join(", ");
  return h(
    "div",
    { class: "row" },
    h("span", { class: "quiet grow" }, `Kept from the file: ${names || "path"}`),
    textButton("Drop", drop, { title: "The file's own goals are asked no more" }),
  );
}

function area(app: App, one: Segment, second: boolean): HTMLElement {
  const label = second ? "What the second person does; empty: the same" : "What the person does";
  return h(
    "textarea",
    {
      class: "words",
      rows: "2",
      "aria-label": label,
      placeholder: label,
      "data-key": `${one.id}${second}`,
      maxlength: "2000",
      spellcheck: "true",
      oninput: (event: Event) =>
        app.project.change("write", (old) => write(old, one.id, (event.target as HTMLTextAreaElement).value, second), {
          merge: `text:${one.id}${second}`,
          typed: true,
        }),
      onkeydown: (event: KeyboardEvent) => {
        if (event.key !== "Escape" && (event.key !== "Enter" || event.shiftKey)) return;
        event.preventDefault();
        (event.target as HTMLElement).blur();
      },
    },
    second ? one.other : one.text,
  );
}

function peopleField(app: App, project: Project): HTMLElement {
  const button = (count: 1 | 2, name: string) =>
    textButton(name, () => app.project.change("change the people", (old) => setPeople(old, count)), {
      pressed: project.people.length === count,
    });
  return h(
    "div",
    { class: "field" },
    h("span", {}, "People"),
    h("span", { class: "switch" }, button(1, "One"), button(2, "Two")),
  );
}

function stagePanels(app: App, project: Project, person: Person, who: number, actions: Actions): HTMLElement[] {
  const { tool } = app.session.value;
  const panels = [];
  if (person.path || tool === "path") panels.push(pathPanel(app, project, person, who));
  if (tool === "target") panels.unshift(targetPanel(app, project, person, who));
  else if (person.targets.length) panels.push(targetPanel(app, project, person, who));
  if (person.poses.length) panels.push(posePanel(app, project, person, who, actions));
  if (project.base && panels.length)
    panels.push(
      h(
        "p",
        { class: "quiet" },
        "While stretches are frozen, only words are drawn; path and targets count again when everything is unfrozen (Shift F).",
      ),
    );
  return panels;
}

function pathPanel(app: App, project: Project, person: Person, who: number): HTMLElement {
  const { path } = person;
  if (!path)
    return section(
      "Path",
      h(
        "p",
        { class: "quiet" },
        "Drag over the floor to draw a path, or click its points one by one. The right button turns the view. Arrow keys move a cursor, Enter puts a point.",
      ),
    );
  const seconds = length(project);
  const walked = timed(path, seconds);
  const clip = shownClip(app);
  const off = isMeasurable(project, clip) ? pathMiss(clip, who, person, seconds) : null;
  const { selection } = app.session.value;
  const index = selection.kind === "point" ? selection.index : -1;
  const point = path.points[index];
  return section(
    who ? "Path of person 2" : "Path",
    h(
      "p",
      { class: "quiet" },
      `${path.points.length} points, ${pathLength(path.points).toFixed(1)} m, ${walked ? `${walked.speed.toFixed(2)} m/s` : "too short"}`,
    ),
    walked?.hurried &&
      h(
        "p",
        { class: "unmet" },
        `At ${path.speed} m/s this path takes longer than the timeline's ${seconds.toFixed(1)} s; it is walked faster. Make a block longer or the path shorter.`,
      ),
    wrong(app, "path"),
    off &&
      h("p", {}, "Off the path: ", miss(off[0], OFF_PATH), " on average, ", miss(off[1], OFF_PATH * 2), " at most"),
    h(
      "div",
      { class: "pair" },
      numberField(
        "Speed",
        path.speed,
        "m/s",
        (speed) => app.project.change("change the speed", (old) => setSpeed(old, who, speed)),
        { min: 0.1, max: 6, step: 0.1, empty: "fill time" },
      ),
    ),
    point &&
      h(
        "div",
        { class: "pair" },
        numberField(
          `Stop at ${index + 1}`,
          point.stop,
          "s",
          (stop) => app.project.change("stop on the path", (old) => changePoint(old, who, index, { stop: stop ?? 0 })),
          { min: 0, max: 30, step: 0.25 },
        ),
        numberField(
          "Facing",
          point.facing,
          "°",
          (facing) => app.project.change("turn a facing", (old) => changePoint(old, who, index, { facing })),
          { min: -3600, max: 3600, step: 15, empty: "along" },
        ),
      ),
    h(
      "div",
      { class: "row" },
      textButton("Clear the path", () => {
        app.session.update({ selection: NOTHING });
        app.project.change("clear the path", (old) => setPath(old, who, null));
      }),
    ),
  );
}

function targetPanel(app: App, project: Project, person: Person, who: number): HTMLElement {
  const clip = shownClip(app);
  const { selection } = app.session.value;
  if (!person.targets.length)
    return section(
      "Targets",
      h(
        "p",
        { class: "quiet" },
        "Go to a time, click a joint and drag its arrows. Arrow keys and Page Up or Down move it, too.",
      ),
    );
  const chosen = selection.kind === "target" ? person.targets.find((one) => one.id === selection.id) : undefined;
  return section(
    "Targets",
    wrong(app, "target"),
    h(
      "ul",
      { class: "list" },
      ...[...person.targets]
        .sort((a, b) => a.time - b.time)
        .map((one) =>
          h(
            "li",
            { class: one === chosen ? "chosen" : "", "data-key": one.id },
            h(
              "button",
              {
                class: "row",
                onclick: () =>
                  app.session.update({
                    selection: { kind: "target", id: one.id },
                    joint: one.joint,
                    time: one.time,
                    playing: false,
                  }),
              },
              h("b", {}, jointName(one.joint)),
              h("small", {}, `${one.time.toFixed(2)}${one.until === null ? "" : ` – ${one.until.toFixed(2)}`} s`),
              miss(isMeasurable(project, clip) ? targetMiss(clip, who, one) : null, UNMET),
            ),
            removeButton(`Delete the target of the ${jointName(one.joint)}`, () =>
              app.project.change("delete a target", (old) => removeTarget(old, who, one.id)),
            ),
          ),
        ),
    ),
    chosen &&
      h(
        "div",
        { class: "pair" },
        numberField(
          "Hold until",
          chosen.until,
          "s",
          (until) => app.project.change("pin a target", (old) => changeTarget(old, who, chosen.id, { until })),
          { min: 0, max: length(project), empty: "one moment" },
        ),
      ),
    chosen &&
      h(
        "div",
        { class: "three" },
        ...(["x", "y", "z"] as const).map((axis, n) =>
          numberField(
            axis,
            chosen.position[n]!,
            "m",
            (value) =>
              value !== null &&
              app.project.change("move a target", (old) =>
                changeTarget(old, who, chosen.id, {
                  position: [0, 1, 2].map((k) => (k === n ? value : chosen.position[k]!)) as [number, number, number],
                }),
              ),
            { step: 0.05, min: axis === "y" ? 0 : -100, max: axis === "y" ? 3 : 100 },
          ),
        ),
      ),
  );
}

function posePanel(app: App, project: Project, person: Person, who: number, actions: Actions): HTMLElement {
  const clip = shownClip(app);
  return section(
    "Poses",
    wrong(app, "pose"),
    h(
      "ul",
      { class: "list" },
      ...[...person.poses]
        .sort((a, b) => a.time - b.time)
        .map((one) =>
          h(
            "li",
            { "data-key": one.id },
            h(
              "button",
              {
                class: "row",
                onclick: () =>
                  app.session.update({ selection: { kind: "pose", id: one.id }, time: one.time, playing: false }),
              },
              h("b", {}, one.name),
              h("small", {}, `${round(one.time)} s`),
              miss(isMeasurable(project, clip) ? poseMiss(clip, who, one) : null, UNMET),
            ),
            removeButton(`Delete ${one.name}`, () =>
              app.project.change("delete a pose", (old) => removePose(old, who, one.id)),
            ),
          ),
        ),
    ),
    h("div", { class: "row" }, textButton("Keyframe this pose", actions.pose!.run, { title: "O" })),
  );
}

function removeButton(label: string, run: () => void): HTMLElement {
  return h("button", { class: "cross", "aria-label": label, title: label, onclick: run }, "×");
}
