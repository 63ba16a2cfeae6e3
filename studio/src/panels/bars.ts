/** The bar at the top, the tools on the stage, and the transport over the timeline. */

import type { Actions } from "../app/actions";
import { type App, duration } from "../app/app";
import { h, morph } from "../app/dom";
import { withKey } from "../app/keys";
import { EXPORT_KEYS, exportGoal, exportName } from "../app/projectActions";
import { chosenBlocks } from "../app/session";
import { begins } from "../project/model";
import { menu, menuHabits } from "./menu";
import { iconButton, textButton } from "./parts";

const PROJECT_KEYS = ["new", "open", "recent", "saveAs", "save", "history"];

export function topBar(app: App, actions: Actions, root: HTMLElement): void {
  const render = () => {
    const { value, undoLabel, redoLabel } = app.project;
    const { connected, saved, drawing, conflict, error, sheet } = app.session.value;
    const words = { saved: "saved", saving: "saving", here: "kept in this browser" };
    const wrong = !connected ? "server away" : conflict ? "not saved" : error?.isFull ? "the disk is full" : null;
    const state = wrong ?? (drawing ? "drawing" : words[saved]);
    morph(root, [
      h("h1", { class: "brand" }, "motionloom"),
      h("input", {
        class: "name",
        value: value.name,
        "aria-label": "Name of the project",
        spellcheck: "false",
        maxlength: "80",
        oninput: (event: Event) =>
          app.project.change("rename", (old) => ({ ...old, name: (event.target as HTMLInputElement).value }), {
            merge: "name",
            typed: true,
          }),
      }),
      menu(actions, PROJECT_KEYS, { title: "Project" }),
      iconButton(actions.undo!, "undo", {
        disabled: undoLabel === null,
        title: undoLabel === null ? "Undo" : `Undo: ${undoLabel}`,
      }),
      iconButton(actions.redo!, "redo", {
        disabled: redoLabel === null,
        title: redoLabel === null ? "Redo" : `Redo: ${redoLabel}`,
      }),
      h("span", { class: "grow" }),
      h("span", { class: `state${wrong ? " away" : ""}`, role: "status" }, state),
      h("progress", {
        class: drawing ? "" : "idle",
        max: String(drawing?.of ?? 1),
        value: String(drawing?.done ?? 0),
        "aria-label": "How far the draw is",
      }),
      iconButton(actions.draw!, "draw"),
      iconButton(actions.four!, "grid", { pressed: value.count === 4, fold: true }),
      menu(actions, EXPORT_KEYS, { title: "Export", strong: true, name: exportName, goal: exportGoal }),
      iconButton(actions.palette!, "search"),
      iconButton(actions.panel!, "panel", { pressed: sheet, key: "panel" }),
      iconButton(actions.theme!, "theme", { fold: true }),
      iconButton(actions.help!, "help", { fold: true }),
    ]);
  };
  menuHabits(root);
  app.project.subscribe(render);
  app.session.subscribe((now, before) => {
    if (
      (["connected", "saved", "drawing", "conflict", "error", "sheet"] as const).some((key) => now[key] !== before[key])
    )
      render();
  });
  render();
}

export function stageBar(app: App, actions: Actions, left: HTMLElement, right: HTMLElement): void {
  const render = () => {
    const { tool, follow, ghosts, trails, person } = app.session.value;
    const two = app.project.value.people.length > 1;
    morph(left, [
      iconButton(actions.select!, "select", { pressed: tool === "select", name: "Select" }),
      iconButton(actions.path!, "path", { pressed: tool === "path", name: "Path" }),
      iconButton(actions.target!, "target", { pressed: tool === "target", name: "Joints" }),
      iconButton(actions.pose!, "pose", { name: "Pose" }),
      iconButton(actions.live!, "live", { pressed: app.live.value !== null, name: "Live" }),
      ...(two
        ? [
            h(
              "button",
              {
                class: `icon who who${person}`,
                title: withKey("Work on the other person", "Q"),
                "aria-label": `Working on person ${person + 1}`,
                onclick: actions.person!.run,
              },
              String(person + 1),
            ),
          ]
        : []),
    ]);
    morph(right, [
      iconButton(actions.follow!, "follow", { pressed: follow, name: "Follow" }),
      iconButton(actions.above!, "above", { name: "Above" }),
      iconButton(actions.ghosts!, "ghosts", { pressed: ghosts, name: "Ghosts" }),
      iconButton(actions.trails!, "trails", { pressed: trails, name: "Trails" }),
    ]);
  };
  app.project.subscribe(render);
  app.live.subscribe((now, before) => {
    if (!now !== !before) render();
  });
  app.session.subscribe((now, before) => {
    if ((["tool", "follow", "ghosts", "trails", "person"] as const).some((key) => now[key] !== before[key])) render();
  });
  render();
}

export function transport(app: App, actions: Actions, root: HTMLElement): void {
  const clock = h("output", { class: "clock", "aria-label": "Time" });
  const render = () => {
    const { playing, repeat, rate, snapping, overwriting, selection, range } = app.session.value;
    const { segments, frozen } = app.project.value;
    const many = chosenBlocks(selection).length;
    const chosen = selection.kind === "segment" ? segments.findIndex((one) => one.id === selection.id) : -1;
    morph(root, [
      iconButton(actions.play!, playing ? "pause" : "play", { title: playing ? "Pause" : "Play" }),
      iconButton(actions.repeat!, "repeat", { pressed: repeat }),
      clock.isConnected ? root.children[2]! : clock,
      h(
        "button",
        {
          class: "text rate",
          title: withKey("Playback rate", "[ and ]"),
          "aria-label": `Playback rate ${rate}`,
          onclick: () => app.session.update({ rate: rate >= 2 ? 0.25 : rate * 2 }),
        },
        `${rate}×`,
      ),
      h("span", { class: "rule" }),
      iconButton(actions.add!, "add"),
      iconButton(actions.split!, "split"),
      iconButton(actions.duplicate!, "duplicate"),
      iconButton(actions.remove!, "remove", { disabled: selection.kind === "none" }),
      h("span", { class: "rule" }),
      iconButton(actions.freeze!, "freeze", { disabled: !range && chosen < 0 }),
      textButton("Unfreeze", actions.unfreeze!.run, {
        title: withKey("Unfreeze everything", "Shift Z"),
        disabled: !frozen.length,
      }),
      h("span", { class: "grow" }),
      h(
        "span",
        { class: "note" },
        range
          ? `${range[0].toFixed(2)} – ${range[1].toFixed(2)} s marked`
          : many > 1
            ? `${many} blocks selected`
            : chosen >= 0
              ? `block ${chosen + 1} of ${segments.length}, from ${begins(segments)[chosen]!.toFixed(2)} s`
              : "",
      ),
      textButton(overwriting ? "Overwrite" : "Ripple", actions.overwriting!.run, {
        title: withKey(
          overwriting
            ? "A moved block lies over others, which stay when they are"
            : "A moved block pushes the others aside",
          "Shift O",
        ),
        pressed: overwriting,
      }),
      textButton("Snap", actions.snapping!.run, { title: withKey("Times catch on marks", "M"), pressed: snapping }),
      textButton("Fit", actions.fit!.run, { title: withKey("Show the whole timeline", "F") }),
      textButton("−", actions.zoomOut!.run, { title: withKey("Zoom out", "-") }),
      textButton("+", actions.zoomIn!.run, { title: withKey("Zoom in", "+") }),
    ]);
    tick();
  };
  const tick = () => {
    clock.textContent = `${app.session.value.time.toFixed(2)} / ${duration(app).toFixed(2)} s`;
  };
  app.project.subscribe(render);
  app.session.subscribe((now, before) => {
    const keys = ["playing", "repeat", "rate", "snapping", "overwriting", "selection", "range", "clips"] as const;
    if (keys.some((key) => now[key] !== before[key])) render();
    else if (now.time !== before.time) tick();
  });
  render();
}
