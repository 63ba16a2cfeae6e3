/** The panel at the right: the selection, its constraints, the takes and the clips. */

import type { Actions } from "../app/actions";
import type { App } from "../app/app";
import type { Deeds } from "../app/deeds";
import { h, morph } from "../app/dom";
import { eventsInBlock } from "../app/blockEvents";
import { type GoalJson, type Project, type Segment, begins, length } from "../project/model";
import { notesOf } from "../project/goals";
import { trackOf } from "../project/tracks";
import { changeSegment, longestTransition, resizeSegment, setPeople, setTransition } from "../project/timeline";
import { clipsSection, fanSection, takesSection } from "./takes";
import { constraintPanels } from "./constraints";
import { trackSection } from "./tracks";
import { markerSection } from "./markers";
import { numberField, section, textButton, wordsArea, wrong } from "./parts";

export function inspector(app: App, actions: Actions, deeds: Deeds, root: HTMLElement): void {
  let measured: readonly string[] = [];
  /** What happens in the block that is selected: it is shown once the server has measured it. */
  const measure = async () => {
    const one = selected(app);
    const lines = one ? await eventsInBlock(app, one) : [];
    if (one !== selected(app) || lines.join() === measured.join()) return;
    measured = lines;
    render();
  };
  const render = () => {
    void measure();
    const { value } = app.project;
    const { fan, person } = app.session.value;
    const who = Math.min(person, value.people.length - 1);
    const constraints = constraintPanels({ app, project: value, person: value.people[who]!, who, actions, deeds });
    const isTool = app.session.value.tool !== "select";
    morph(
      root,
      fan
        ? [fanSection(app, deeds, fan)]
        : [
            ...(isTool ? constraints : []),
            words(app, value, deeds, measured, actions),
            ...(isTool ? [] : constraints),
            takesSection(app, value, actions),
            clipsSection(app, value, deeds),
          ],
    );
  };
  app.project.subscribe(render);
  app.session.subscribe((now, before) => {
    const keys = ["selection", "clips", "fan", "person", "tool", "sideBySide", "error"] as const;
    if (keys.some((key) => now[key] !== before[key])) render();
  });
  render();
}

function selected(app: App): Segment | null {
  const { selection } = app.session.value;
  return app.project.value.segments.find((one) => selection.kind === "segment" && one.id === selection.id) ?? null;
}

function words(app: App, project: Project, deeds: Deeds, measured: readonly string[], actions: Actions): HTMLElement {
  const { selection } = app.session.value;
  const one = selected(app);
  const index = one ? project.segments.indexOf(one) : -1;
  const marker = selection.kind === "marker" && project.markers.find(({ id }) => id === selection.id);
  if (marker) return markerSection(app, marker, actions.remove!.run);
  const track = selection.kind === "track" && trackOf(project, app.session.value.person, selection.id);
  if (track) return trackSection(app, track, actions.remove!.run);
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
      givenGoalSection(project.given, () =>
        app.project.change("drop what the file asked", (old) => ({ ...old, given: null })),
      ),
    );
  }
  const two = project.people.length > 1;
  return section(
    `Block ${index + 1}`,
    area(deeds, one, false),
    two && area(deeds, one, true),
    wrong(app, "segment", one.id),
    ...remarks(project, one, deeds),
    ...measured.map((line) => h("p", { class: "quiet told" }, line)),
    givenGoalSection(one.given, () =>
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
      textButton("Draw only this block", () => void deeds.redraw(one.id), {
        title: "The rest of the motion stays as it is",
        disabled: !project.takes.length || project.segments.length < 2,
      }),
    ),
  );
}

/** What is remarked on the words of a block, with sentences that are known, to take instead. */
function remarks(project: Project, one: Segment, deeds: Deeds): HTMLElement[] {
  return notesOf(project, one).map(({ text, line, instead }) => {
    const second = text.trim() === one.other.trim();
    const isOfOne = second || text.trim() === one.text.trim();
    const take = (sentence: string) =>
      textButton(sentence, () => deeds.write(one.id, sentence, second), { title: "Take these words instead" });
    return h(
      "div",
      { class: "remark", role: "note" },
      h("p", {}, isOfOne && instead.length ? line.replace(/; nearest: .*/, ". Known are:") : line),
      isOfOne && instead.length > 0 && h("div", { class: "row wrap" }, ...instead.map(take)),
    );
  });
}

/** What a timeline file asks besides, and a way to be rid of it. */
function givenGoalSection(given: GoalJson | null, drop: () => void): HTMLElement | null {
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

function area(deeds: Deeds, one: Segment, second: boolean): HTMLElement {
  const label = second ? "What the second person does; empty: the same" : "What the person does";
  return wordsArea(label, `${one.id}${second}`, second ? one.other : one.text, (text) =>
    deeds.write(one.id, text, second),
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
