/** Everything that can be done, found by a few letters of its name. */

import type { Action, Actions } from "../app/actions";
import type { App } from "../app/app";
import { h, morph } from "../app/dom";
import { dialog } from "./dialog";
import { shownKey } from "./parts";

/** Where this browser keeps what was done last from the palette. */
const RECENT = "motionloom-recent";

/** Actions that a few letters name, the best first; without letters all of them. */
export function matchingActions(actions: readonly Action[], letters: string): Action[] {
  const parts = letters.toLowerCase().split(/\s+/).filter(Boolean);
  const score = ({ label, group, note = "", also = "" }: Action): number => {
    const words = `${label} ${group} ${note} ${also}`.toLowerCase();
    if (!parts.every((part) => words.includes(part))) return 0;
    return parts.every((part) => new RegExp(`\\b${escaped(part)}`).test(label.toLowerCase())) ? 2 : 1;
  };
  return actions
    .map((one) => ({ one, score: parts.length ? score(one) : 1 }))
    .filter(({ score: one }) => one > 0)
    .sort((a, b) => b.score - a.score)
    .map(({ one }) => one);
}

export function palette(app: App, actions: Actions): void {
  const input = h("input", {
    class: "search",
    type: "text",
    role: "combobox",
    "aria-label": "What to do",
    "aria-expanded": "true",
    "aria-controls": "palette-list",
    "aria-autocomplete": "list",
    placeholder: "What to do",
    spellcheck: "false",
    autofocus: true,
  }) as HTMLInputElement;
  const list = h("ul", { id: "palette-list", role: "listbox", "aria-label": "What can be done" });
  let shown: Action[] = [];
  let at = 0;
  const run = (action: Action | undefined) => {
    if (!action) return;
    app.session.update({ dialog: null });
    localStorage.setItem(
      RECENT,
      JSON.stringify([action.label, ...recent().filter((one) => one !== action.label)].slice(0, 5)),
    );
    action.run();
  };
  const render = () => {
    at = Math.min(Math.max(at, 0), Math.max(shown.length - 1, 0));
    morph(
      list,
      shown.length
        ? shown.map((action, index) => row(action, index, index === at, () => run(action)))
        : [
            h(
              "li",
              { class: "quiet", role: "option", "aria-disabled": "true", "aria-selected": "false" },
              "Nothing is called so.",
            ),
          ],
    );
    input.setAttribute("aria-activedescendant", shown.length ? `palette-${at}` : "");
    list.querySelector("[aria-selected=true]")?.scrollIntoView({ block: "nearest" });
  };
  const look = () => {
    const there = Object.values(actions).filter((one) => one !== actions.palette && (one.isThere?.() ?? true));
    const last = recent();
    const rank = ({ label }: Action) => (last.includes(label) ? last.indexOf(label) : last.length);
    shown = input.value.trim() ? matchingActions(there, input.value) : there.sort((a, b) => rank(a) - rank(b));
    at = 0;
    render();
  };
  input.addEventListener("input", look);
  input.addEventListener("keydown", (event) => {
    const by: Record<string, number> = { ArrowDown: 1, ArrowUp: -1, PageDown: 8, PageUp: -8 };
    if (event.key in by) at += by[event.key]!;
    else if (event.key === "Enter") return run(shown[at]);
    else return;
    event.preventDefault();
    render();
  });
  dialog(app, "palette", "Everything that can be done", () => {
    input.value = "";
    look();
    return [input, list];
  });
}

/** What was done last from here, the last one first. */
function recent(): readonly string[] {
  try {
    const found: unknown = JSON.parse(localStorage.getItem(RECENT) ?? "[]");
    return Array.isArray(found) ? found.map(String) : [];
  } catch {
    return [];
  }
}

function row(action: Action, index: number, chosen: boolean, run: () => void): HTMLElement {
  return h(
    "li",
    { id: `palette-${index}`, role: "option", "aria-selected": String(chosen), onclick: run },
    h("span", { class: "grow" }, action.label, h("small", {}, action.note ?? "")),
    h("small", { class: "group" }, action.group),
    ...action.keys.slice(0, 1).map((key) => h("kbd", {}, shownKey(key))),
  );
}

function escaped(text: string): string {
  return text.replaceAll(/[.*+?^${}()|[\]\\]/g, "\\$&");
}
