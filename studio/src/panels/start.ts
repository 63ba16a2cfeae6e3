/** The first question: what the person should do, with sentences that work. */

import type { App } from "../app/app";
import { h } from "../app/dom";
import type { Projects } from "../app/projects";
import { CHIPS } from "../project/chips";

/** `lift` shows the stage so many pixels higher, so that the card hides nobody. */
export function startCard(app: App, projects: Projects, root: HTMLElement, lift: (pixels: number) => void): void {
  const input = h("input", {
    type: "text",
    "aria-label": "What should the person do?",
    placeholder: "a person walks, turns around and waves",
    maxlength: "2000",
    autocomplete: "off",
  }) as HTMLInputElement;
  const close = () => app.session.update({ welcome: false });
  root.append(
    h(
      "header",
      {},
      h("h2", {}, "What should the person do?"),
      h("button", { class: "cross", "aria-label": "Close", title: "Close (Esc)", onclick: close }, "×"),
    ),
    h(
      "form",
      {
        onsubmit: (event: Event) => {
          event.preventDefault();
          if (input.value.trim()) void projects.start(input.value);
        },
      },
      input,
      h("button", { class: "text strong" }, "Draw"),
    ),
    h(
      "div",
      { class: "chips" },
      ...CHIPS.map(({ text, seed }) =>
        h("button", { class: "chip", onclick: () => void projects.start(text, seed) }, text),
      ),
    ),
    h("p", { class: "quiet" }, "Or drop a motion, a character or a project anywhere."),
  );
  root.addEventListener("keydown", (event) => {
    if (event.key !== "Escape") return;
    event.stopPropagation();
    close();
  });
  const show = () => {
    const { welcome } = app.session.value;
    if (welcome === !root.hidden) return;
    root.hidden = !welcome;
    lift(welcome ? root.offsetHeight / 2 : 0);
    if (!welcome) return;
    input.value = "";
    input.focus({ preventScroll: true });
  };
  app.session.subscribe(show);
  // Whoever goes to work needs no question.
  app.project.subscribe((_, { label }) => label && close());
  show();
}
