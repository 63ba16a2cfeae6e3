/** The tracks of parts of the body, below those of what is asked of the whole. */

import type { App } from "../app/app";
import { h } from "../app/dom";
import { writeTrack } from "../panels/tracks";
import { type Project, keptTake } from "../project/model";
import { ORDER, PARTS, type Part, trackKey, trackText } from "../project/tracks";
import { hint } from "./hint";

/** What parts of the body may do, while none does anything. */
const BEGINNINGS = [
  ["track", "Let an arm do something else", "Shift A"],
  ["look", "Look somewhere", "Shift L"],
  ["smooth", "Smooth", "Shift N"],
] as const;

/** The parts that have words of their own; null in place of them: none has. */
export function partsShown(project: Project, who: number): (Part | null)[] {
  const { tracks } = project.people[Math.min(who, project.people.length - 1)]!;
  const used = ORDER.filter((part) => tracks.some((one) => one.part === part));
  return used.length ? used : [null];
}

/** `span`: the place of a stretch, as a style. */
export function trackRows(app: App, who: number, span: (from: number, until: number) => string): HTMLElement[] {
  const { value } = app.project;
  const { selection } = app.session.value;
  const drawn = keptTake(value)?.tracks ?? [];
  return partsShown(value, who).map((part) => {
    const own = value.people[who]!.tracks.filter((one) => one.part === part);
    const stretches = own.map((one) => {
      const text = trackText(one);
      const isOld = text !== "" && !drawn.includes(trackKey(who, one));
      const isChosen = selection.kind === "track" && selection.id === one.id;
      const label = `${PARTS[one.part].name}: ${text || "nothing yet"}, ${one.from.toFixed(2)} to ${one.until.toFixed(2)} s`;
      const edge = (name: "from" | "until", side: string) =>
        h("i", { class: `edge ${side}`, "data-drag": `track-${name}`, "data-id": one.id });
      return h(
        "button",
        {
          class: `own${isChosen ? " chosen" : ""}${isOld ? " old" : ""}${text ? "" : " empty"}`,
          style: span(one.from, one.until),
          "data-drag": "track",
          "data-id": one.id,
          "data-key": one.id,
          title: label,
          "aria-label": label,
          // By the keyboard: the pointer drags it, and writes in it by a double-click.
          onclick: (event: MouseEvent) => event.detail === 0 && writeTrack(app, one.id),
          onfocus: () => isChosen || app.session.update({ selection: { kind: "track", id: one.id } }),
        },
        text || "write what it does",
        edge("from", "from"),
        edge("until", "to"),
      );
    });
    return h(
      "div",
      {
        class: "track parts",
        "data-drag": "band",
        "data-key": `part${part}`,
        role: "group",
        "aria-label": part ? PARTS[part].name : "Parts of the body",
      },
      ...(part ? stretches : BEGINNINGS.map(([act, text, key]) => hint(act, text, key))),
    );
  });
}
