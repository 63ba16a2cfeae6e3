/** The panels of constraints besides words: the path, targets of joints, poses. */

import type { Actions } from "../app/actions";
import { type App, shownClip } from "../app/app";
import type { Deeds } from "../app/deeds";
import { h } from "../app/dom";
import { TOUCH, withKey } from "../app/keys";
import { NOTHING } from "../app/session";
import { jointName } from "../body/skeleton";
import { changePoint, changeTarget, removePose, removeTarget, setPath, setSpeed } from "../project/constraints";
import { FLYING, UNMET, isMeasurable, pathMiss, poseMiss, targetLift, targetMiss } from "../project/misses";
import { type Person, type Project, length, round } from "../project/model";
import { pathLength, timed } from "../project/path";
import { fights } from "../project/tracks";
import { miss, numberField, section, textButton, wrong } from "./parts";

/** Centimetres beyond which a path counts as missed. */
const OFF_PATH = 15;
/** Poses between two at most. */
const MOST_FILLED = 20;
/** Centimetres by which feet leave the floor in a step. */
const STEP = 12;

/** What the panels of one person show and change. */
export interface PersonContext {
  readonly app: App;
  readonly project: Project;
  readonly person: Person;
  /** 0 or 1. */
  readonly who: number;
  readonly actions: Actions;
  readonly deeds: Deeds;
}

export function constraintPanels(context: PersonContext): HTMLElement[] {
  const { app, project, person } = context;
  const { tool } = app.session.value;
  const panels = [];
  if (person.path || tool === "path") panels.push(pathPanel(context));
  if (tool === "target") panels.unshift(targetPanel(context));
  else if (person.targets.length) panels.push(targetPanel(context));
  if (person.poses.length) panels.push(posePanel(context));
  if (project.base && panels.length)
    panels.push(
      h(
        "p",
        { class: "quiet" },
        "While stretches are frozen, only words are drawn; path and targets count again when everything is unfrozen.",
      ),
    );
  return panels;
}

function pathPanel({ app, project, person, who }: PersonContext): HTMLElement {
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
  const schedule = timed(path, seconds);
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
      `${path.points.length} points, ${pathLength(path.points).toFixed(1)} m, ${schedule ? `${schedule.speed.toFixed(2)} m/s` : "too short"}`,
    ),
    schedule?.hurried &&
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

function targetPanel({ app, project, person, who }: PersonContext): HTMLElement {
  const clip = shownClip(app);
  const { selection } = app.session.value;
  if (!person.targets.length)
    return section(
      "Targets",
      h(
        "p",
        { class: "quiet" },
        `Go to a time, press a joint and drag its arrows.${TOUCH ? "" : " Arrow keys and Page Up or Down move it, too."}`,
      ),
    );
  const chosen = selection.kind === "target" ? person.targets.find((one) => one.id === selection.id) : undefined;
  return section(
    "Targets",
    wrong(app, "target"),
    ...fights(person).map((line) => h("p", { class: "remark", role: "note" }, line)),
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
              isMeasurable(project, clip) && flight(targetLift(clip, who, one)),
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

/** How far the body left the floor for a target, where that is more than a step. */
function flight(centimetres: number): HTMLElement | false {
  if (centimetres < STEP) return false;
  const title = "The limb is too short: the whole person leaves the floor for it";
  return h("span", { class: centimetres > FLYING ? "miss unmet" : "miss", title }, `↑ ${centimetres.toFixed(0)} cm`);
}

function posePanel({ app, project, person, who, actions, deeds }: PersonContext): HTMLElement {
  const clip = shownClip(app);
  const { selection, tool } = app.session.value;
  const chosen = selection.kind === "pose" && person.poses.find((one) => one.id === selection.id);
  const hasNext = chosen && person.poses.some((one) => one.time > chosen.time);
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
            { "data-key": one.id, class: one === chosen ? "chosen" : "" },
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
    chosen &&
      h(
        "p",
        { class: "quiet" },
        tool === "target"
          ? `Drag its joints${TOUCH ? "" : ": Shift and click chooses several, which move together; Alt P pins what is to stay"}.`
          : "Choose Joints, then drag its joints.",
      ),
    h(
      "div",
      { class: "row wrap" },
      textButton("Keyframe this pose", actions.pose!.run, { title: withKey("Ask for the pose at the playhead", "O") }),
      textButton("Copy", actions.copyPose!.run, { title: withKey("Copy the pose", "Alt C") }),
      textButton("Paste", actions.pastePose!.run, { title: withKey("Paste the pose at the playhead", "Alt V") }),
      textButton("Mirror", actions.mirrorPose!.run, { title: withKey("Exchange left and right", "Alt M") }),
    ),
    hasNext &&
      h(
        "div",
        { class: "pair" },
        numberField(
          "Poses to the next one",
          null,
          "",
          (count) => count !== null && deeds.fillPoses(Math.round(count)),
          {
            min: 1,
            max: MOST_FILLED,
            step: 1,
            empty: "how many",
          },
        ),
      ),
  );
}

function removeButton(label: string, run: () => void): HTMLElement {
  return h("button", { class: "cross", "aria-label": label, title: label, onclick: run }, "×");
}
