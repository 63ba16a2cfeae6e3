/** Takes to choose from, futures to choose from, and clips that were put aside. */

import type { Actions } from "../app/actions";
import type { App } from "../app/app";
import type { Deeds } from "../app/deeds";
import { h } from "../app/dom";
import { TOUCH, withKey } from "../app/keys";
import type { Fan } from "../app/session";
import { type Clip, type Project, CHANGED, NO_CONSTRAINTS, keptTake } from "../project/model";
import { GHOSTS } from "../stage/theme";
import { section, shownKey, textButton } from "./parts";

export function takesSection(app: App, project: Project, actions: Actions): HTMLElement {
  const { clips, sideBySide } = app.session.value;
  const choose = (index: number) =>
    app.project.change(`keep take ${index + 1}`, (old) => (old.kept === index ? old : { ...old, kept: index }));
  const deed = (key: string, text: string, disabled = false) =>
    textButton(text, actions[key]!.run, {
      title: withKey(actions[key]!.label, shownKey(actions[key]!.keys[0]!)),
      disabled,
    });
  const none = !project.takes.length;
  return section(
    "Takes",
    h(
      "div",
      { class: "takes", role: "radiogroup", "aria-label": "Takes" },
      ...project.takes.map((take, index) =>
        h(
          "button",
          {
            class: `take${index === project.kept ? " chosen" : ""}`,
            role: "radio",
            "aria-checked": String(index === project.kept),
            onclick: () => choose(index),
            title: `Seed ${take.seed}, ${take.how}`,
          },
          h("i", {
            style: `background:${project.takes.length > 1 ? GHOSTS[index % GHOSTS.length] : "var(--accent)"}`,
          }),
          `${index + 1}`,
          h("small", {}, ["drawn", CHANGED].includes(take.how) ? `seed ${take.seed}` : take.how),
        ),
      ),
    ),
    obedience(project, actions),
    ...(keptTake(project)?.told ?? [])
      .filter((one) => !MISSED.test(one))
      .map((one) => h("p", { class: "quiet told" }, one)),
    deepest(project) > 0 &&
      h(
        "p",
        { class: "unmet" },
        `The two are in each other by up to ${Math.round(deepest(project) * 100)} cm: red on the ruler.`,
      ),
    clips.length > 1 &&
      h(
        "div",
        { class: "row" },
        textButton("Side by side", actions.beside!.run, { pressed: sideBySide, title: withKey("All takes", "B") }),
      ),
    h(
      "div",
      { class: "row wrap" },
      deed("draw", "Draw again"),
      keptTake(project)?.how === CHANGED && deed("drawAll", "Draw all blocks"),
      deed("four", project.count === 4 ? "One take" : "Four takes"),
      deed("predict", "What comes next", none),
      deed("loop", "Loop", none),
      deed("aside", "Put aside", none),
    ),
  );
}

/** Seconds of the longest motion in which the words are looked for. */
const LOOKED = 120;

/** What of the words was looked for and is not in the motion, as the server says it. */
const MISSED = /^not seen: (.+)$/;

/** Whether what the words say plainly is seen in the kept take; of others, such as clips, nothing is said. */
function obedience(project: Project, actions: Actions): HTMLElement | false {
  const take = keptTake(project);
  const told = take?.told ?? [];
  const lines = [...told, ...(take?.notes ?? []).map((one) => one.line)];
  const found = lines.map((one) => MISSED.exec(one)?.[1]).filter((one) => one !== undefined);
  const missed = found.length ? [...new Set(found)].join(", ") : undefined;
  if (missed !== undefined) {
    const more =
      project.count === 4 ? textButton("Draw again?", actions.draw!.run) : textButton("Four takes?", actions.four!.run);
    return h(
      "div",
      { class: "row wrap seen" },
      h("b", { class: "badge not" }, "Not seen"),
      h("span", { class: "grow" }, missed),
      more,
    );
  }
  const isWhole =
    take?.how === "drawn" && !take.notes?.length && told.length === 1 && take.people === 1 && take.seconds <= LOOKED;
  const title = "Nothing that the words say plainly is missing";
  return (
    isWhole &&
    h("div", { class: "row seen" }, h("b", { class: "badge", title }, "Seen"), h("span", {}, "what the words ask for"))
  );
}

/** Metres by which one body is in the other at most. */
function deepest(project: Project): number {
  return Math.max(0, ...(keptTake(project)?.overlaps ?? []).map((one) => one.depth));
}

export function fanSection(app: App, deeds: Deeds, fan: Fan): HTMLElement {
  return section(
    "What could come next",
    h(
      "p",
      { class: "quiet" },
      `Each ghost is a future of this motion. Choose one${TOUCH ? "." : " with its number, or leave with Escape."}`,
    ),
    h(
      "div",
      { class: "takes" },
      ...fan.clips.map((clip, index) =>
        h(
          "button",
          { class: "take", onclick: () => deeds.chooseFuture(index), title: `Go on with future ${index + 1}` },
          h("i", { style: `background:${GHOSTS[index % GHOSTS.length]}` }),
          `${index + 1}`,
          h("small", {}, `+${(clip.seconds - fan.past).toFixed(1)} s`),
        ),
      ),
    ),
    h(
      "div",
      { class: "row" },
      textButton("None of them", () => app.session.update({ fan: null })),
    ),
  );
}

export function clipsSection(app: App, project: Project, deeds: Deeds): HTMLElement {
  if (!project.clips.length && !project.character) {
    return section(
      "Clips and character",
      h("p", { class: "quiet" }, "Drop BVH, AMC, GLB or VRM files anywhere. What is put aside appears here, too."),
    );
  }
  return section(
    "Clips and character",
    project.character &&
      h(
        "div",
        { class: "row" },
        h("b", { class: "grow ellipsis" }, project.character.name),
        textButton("Mannequin", () => app.project.change("use the mannequin", (old) => ({ ...old, character: null }))),
      ),
    project.clips.length > 1 &&
      h("p", { class: "quiet" }, "Drag one clip onto another to go over from it to that one."),
    h("ul", { class: "list" }, ...project.clips.map((clip, index) => clipRow(app, project, deeds, clip, index))),
  );
}

function clipRow(app: App, project: Project, deeds: Deeds, clip: Clip, index: number): HTMLElement {
  const others = project.clips.filter((one) => one !== clip);
  const choices: [string, () => void][] = [
    ["Put on the timeline", () => deeds.putOnTimeline(clip)],
    ["Pose of its middle, at the playhead", () => void deeds.poseFrom(clip)],
    [
      "Answer it with a second person",
      () =>
        app.project.change("answer a clip", (old) => ({
          ...old,
          people: [old.people[0]!, old.people[1] ?? NO_CONSTRAINTS],
          reactTo: clip,
          base: null,
          frozen: [],
        })),
    ],
    ...others.map((other): [string, () => void] => [`Switch to ${other.name}`, () => void deeds.switch(clip, other)]),
    [
      "Remove from this list",
      () => app.project.change("remove a clip", (old) => ({ ...old, clips: old.clips.filter((one) => one !== clip) })),
    ],
  ];
  const select = h(
    "select",
    {
      "aria-label": `What to do with ${clip.name}`,
      onchange: (event: Event) => {
        const list = event.target as HTMLSelectElement;
        choices[list.selectedIndex - 1]?.[1]();
        list.selectedIndex = 0;
      },
    },
    h("option", { value: "" }, "⋯"),
    ...choices.map(([name], n) => h("option", { value: String(n) }, name)),
  );
  return h(
    "li",
    {
      class: "clip",
      draggable: "true",
      "data-key": clip.motion,
      ondragstart: (event: DragEvent) => event.dataTransfer?.setData("text/x-clip", String(index)),
      ondragover: (event: DragEvent) => {
        if (!event.dataTransfer?.types.includes("text/x-clip")) return;
        event.preventDefault();
        (event.currentTarget as Element).classList.add("over");
      },
      ondragleave: (event: DragEvent) => (event.currentTarget as Element).classList.remove("over"),
      ondrop: (event: DragEvent) => {
        (event.currentTarget as Element).classList.remove("over");
        const from = project.clips[Number(event.dataTransfer?.getData("text/x-clip") || -1)];
        if (!from || from === clip) return;
        event.preventDefault();
        event.stopPropagation();
        void deeds.switch(from, clip);
      },
    },
    h("b", { class: "grow ellipsis", title: clip.name }, clip.name),
    h("small", {}, `${clip.seconds.toFixed(1)} s`),
    select,
  );
}
