/** Lists by pictures: the states of this project, and the projects of the folder. */

import type { App } from "../app/app";
import { h } from "../app/dom";
import type { Projects } from "../app/projects";
import { inks, strip } from "../body/figure";
import { keptTake } from "../project/model";
import { type ProjectRow, motion } from "../server/api";
import { dialog } from "./dialog";
import { textButton } from "./parts";

const POSES = 6;

/** A row of poses of a motion; it is fetched once the picture is to be seen. */
function picture(id: string | null): HTMLElement {
  const canvas = h("canvas", { class: "strip-of", "aria-hidden": "true" }) as HTMLCanvasElement;
  const seen = new IntersectionObserver(([entry]) => {
    if (!entry?.isIntersecting || !id) return;
    seen.disconnect();
    motion(id)
      .then((clip) => strip(canvas, clip, POSES, inks()))
      .catch(() => canvas.classList.add("gone")); // a motion that made room for newer ones
  });
  seen.observe(canvas);
  return canvas;
}

export function historyPictures(app: App): void {
  const root = dialog(app, "history", "History", () => {
    const { all, now } = app.project.states;
    const rows = all.map(({ value, label }, index) =>
      h(
        "li",
        { "data-key": String(index) },
        h(
          "button",
          {
            class: "card",
            "aria-current": index === now ? "step" : null,
            onclick: () => {
              app.session.update({ dialog: null });
              app.project.go(index);
            },
          },
          picture(keptTake(value)?.motion ?? null),
          h("b", {}, label),
          h("small", {}, value.segments.map((one) => one.text || "…").join(" · ")),
        ),
      ),
    );
    requestAnimationFrame(() => {
      const current = root.querySelector<HTMLElement>("[aria-current]");
      current?.scrollIntoView({ block: "center" });
      current?.focus({ preventScroll: true });
    });
    return [
      h(
        "p",
        { class: "quiet" },
        "Each picture is a state of this project. Choose one to go back to it, or on to it again.",
      ),
      h("ol", { class: "cards" }, ...rows.reverse()),
    ];
  });
}

export function recentProjects(app: App, projects: Projects): void {
  const list = h("ul", { class: "cards" });
  const load = async () => {
    try {
      const rows = await projects.rows();
      list.replaceChildren(...rows.map((row) => h("li", {}, projectCard(row, projects))));
      if (!rows.length) list.append(h("li", { class: "quiet" }, "Nothing has been saved yet."));
    } catch (error) {
      list.replaceChildren(h("li", { class: "unmet", role: "alert" }, (error as Error).message));
    }
  };
  dialog(app, "projects", "Projects", () => {
    list.replaceChildren(h("li", { class: "quiet" }, "Looking …"));
    void load();
    return [
      h(
        "div",
        { class: "row" },
        textButton("New project", () => void projects.blank(), { strong: true }),
      ),
      list,
    ];
  });
}

function projectCard(row: ProjectRow, projects: Projects): HTMLElement {
  const when = new Date(row.saved).toLocaleString([], { dateStyle: "medium", timeStyle: "short" });
  const more = row.blocks > row.words.length ? " …" : "";
  return h(
    "button",
    { class: "card", "aria-current": row.open ? "true" : null, onclick: () => void projects.open(row) },
    picture(row.motion),
    h("b", {}, row.name || "Untitled", row.open ? " (open)" : ""),
    h("small", {}, `${row.words.map((one) => one || "…").join(" · ")}${more}`),
    h("small", {}, `${row.seconds.toFixed(1)} s, ${when}`),
  );
}

/** Asks for the name of a copy. */
export function nameDialog(app: App, projects: Projects): void {
  const input = h("input", { class: "search", maxlength: "80", "aria-label": "Name of the copy" }) as HTMLInputElement;
  const form = h(
    "form",
    {
      onsubmit: (event: Event) => {
        event.preventDefault();
        if (input.value.trim()) void projects.saveAs(input.value.trim());
      },
    },
    h("p", { class: "quiet" }, "You go on in a copy of this name. What was saved under the old name stays as it is."),
    input,
    h("div", { class: "row end" }, h("button", { class: "text strong" }, "Save as")),
  );
  dialog(app, "name", "Save as another project", () => {
    input.value = `${app.project.value.name} 2`;
    requestAnimationFrame(() => input.select());
    return [form];
  });
}
