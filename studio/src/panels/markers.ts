/** The marker that is selected: its name and its time. */

import type { App } from "../app/app";
import { h } from "../app/dom";
import { withKey } from "../app/keys";
import { changeMarker } from "../project/markers";
import { type Marker, length } from "../project/model";
import { numberField, section, textButton } from "./parts";

export function markerSection(app: App, marker: Marker, remove: () => void): HTMLElement {
  return section(
    "Marker",
    h("input", {
      class: "line",
      value: marker.name,
      "aria-label": "Name of the marker",
      maxlength: "80",
      oninput: (event: Event) =>
        app.project.change(
          "name a marker",
          (old) => changeMarker(old, marker.id, { name: (event.target as HTMLInputElement).value }),
          { merge: `marker:${marker.id}`, typed: true },
        ),
    }),
    h(
      "div",
      { class: "pair" },
      numberField(
        "Time",
        marker.time,
        "s",
        (time) => time !== null && app.project.change("move a marker", (old) => changeMarker(old, marker.id, { time })),
        { min: 0, max: length(app.project.value) },
      ),
    ),
    h("div", { class: "row" }, textButton("Delete", remove, { title: withKey("Delete the marker", "Del") })),
  );
}
