/** What the person should do: the first question, with sentences that work, and the field that is there from then on. */

import type { App } from "../app/app";
import { h } from "../app/dom";
import { withKey } from "../app/keys";
import type { Projects } from "../app/projects";
import { CHIPS } from "../project/chips";
import { hasWords } from "../project/model";

/** Pixels around the card. */
const ROUND = 36;

/** `showAbove` shows the people above so many pixels, so that the card hides nobody. */
export function startCard(app: App, projects: Projects, root: HTMLElement, showAbove: (pixels: number) => void): void {
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
      h("button", { class: "cross", "aria-label": "Close", title: withKey("Close", "Esc"), onclick: close }, "×"),
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
    showAbove(welcome ? root.offsetHeight + ROUND : 0);
    if (!welcome) return;
    input.value = "";
    input.focus({ preventScroll: true });
  };
  app.session.subscribe(show);
  // Whoever goes to work needs no question.
  app.project.subscribe((_, { label }) => label && close());
  show();
}

/** The field that is always there: what happens next. While nothing is written in it, keys that write nothing act on the page. */
export function promptBar(app: App, projects: Projects, root: HTMLElement): void {
  const input = h("input", { type: "text", maxlength: "2000", autocomplete: "off" }) as HTMLInputElement;
  const add = h("button", { class: "text strong" });
  const anew = h("button", { class: "text", type: "button", title: "A project of its own; this one stays" }, "New");
  const say = async (deed: (sentence: string) => Promise<void>) => {
    const sentence = input.value.trim();
    if (!sentence) return input.focus();
    [input.value, anew.hidden] = ["", true];
    input.blur();
    await deed(sentence);
  };
  anew.hidden = true;
  anew.onclick = () => void say((sentence) => projects.startAnew(sentence));
  input.oninput = () => (anew.hidden = !input.value.trim() || !hasWords(app.project.value));
  root.append(
    h(
      "form",
      {
        onsubmit: (event: Event) => {
          event.preventDefault();
          void say((sentence) => projects.goOn(sentence));
        },
      },
      input,
      add,
      anew,
    ),
  );
  root.addEventListener("keydown", (event) => {
    if (event.key !== "Escape") return;
    event.stopPropagation();
    input.blur();
  });
  const show = () => {
    root.hidden = app.session.value.welcome || app.live.value !== null;
    const question = hasWords(app.project.value) ? "What happens next?" : "What should the person do?";
    input.placeholder = question;
    input.setAttribute("aria-label", question);
    add.textContent = hasWords(app.project.value) ? "Add" : "Draw";
  };
  app.session.subscribe((now, before) => now.welcome !== before.welcome && show());
  app.live.subscribe(show);
  app.project.subscribe(show);
  show();
}
