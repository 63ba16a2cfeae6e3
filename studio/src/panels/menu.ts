/** Menus: `details` elements, whose state is the browser's and outlives every new picture of the bar. */

import type { Action, Actions } from "../app/actions";
import { h } from "../app/dom";
import { shownKey } from "./parts";

/** A menu of actions; `name` gives what each is called in it. */
export function menu(
  actions: Actions,
  keys: readonly string[],
  options: {
    title: string;
    strong?: boolean;
    name?: (key: string, action: Action) => string;
    /** What the entries from this one on are for; empty: as before. */
    goal?: (key: string) => string;
  },
): HTMLElement {
  const { title, strong = false, name = (_, action) => action.label, goal = () => "" } = options;
  const rows = keys.map((key) => ({ key, action: actions[key]! })).filter(({ action }) => action.isThere?.() ?? true);
  return h(
    "details",
    { class: "menu", "data-key": title },
    h("summary", { class: strong ? "text strong" : "text", "aria-label": title }, title),
    h(
      "div",
      { class: "sheet" },
      ...rows.flatMap(({ key, action }) => [
        goal(key) && h("p", { class: "goal" }, goal(key)),
        h(
          "button",
          {
            class: "row",
            onclick: (event: Event) => {
              close((event.currentTarget as Element).closest("details"));
              action.run();
            },
          },
          h("b", {}, name(key, action)),
          ...action.keys.slice(0, 1).map((one) => h("kbd", {}, shownKey(one))),
          action.note && h("small", {}, action.note),
        ),
      ]),
    ),
  );
}

/** What menus in `root` do by keys, and that they close where somebody goes elsewhere. */
export function menuHabits(root: HTMLElement): void {
  const open = () => root.querySelector<HTMLDetailsElement>("details[open]");
  root.addEventListener("keydown", (event) => {
    const menu = open();
    if (!menu?.contains(event.target as Node)) return;
    const rows = [...menu.querySelectorAll<HTMLButtonElement>("button:enabled")];
    const at = rows.indexOf(event.target as HTMLButtonElement);
    const next: Record<string, number> = {
      ArrowDown: (at + 1) % rows.length,
      ArrowUp: (Math.max(at, 0) + rows.length - 1) % rows.length,
      Home: 0,
      End: rows.length - 1,
    };
    if (event.key === "Escape") close(menu);
    else if (event.key in next) rows[next[event.key]!]!.focus();
    else return;
    event.preventDefault();
    event.stopPropagation();
  });
  root.addEventListener("focusout", (event) => {
    const menu = open();
    if (menu && event.relatedTarget && !menu.contains(event.relatedTarget as Node)) menu.open = false;
  });
  document.addEventListener("pointerdown", (event) => {
    const menu = open();
    if (menu && !menu.contains(event.target as Node)) menu.open = false;
  });
}

/** The keyboard goes on where the menu was opened. */
function close(menu: HTMLDetailsElement | null): void {
  if (!menu) return;
  if (menu.contains(document.activeElement)) menu.querySelector("summary")!.focus();
  menu.open = false;
}
