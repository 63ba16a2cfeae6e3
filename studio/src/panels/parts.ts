/** Parts that every panel is made of. */

import type { Action } from "../app/actions";
import type { App } from "../app/app";
import { h } from "../app/dom";
import { withKey } from "../app/keys";
import type { Place } from "../project/places";
import { type Icon, icon } from "./icons";

/** A button of an action with its picture; its words and its key are in the title. */
export function iconButton(
  action: Pick<Action, "label" | "keys" | "run">,
  name: Icon,
  options: { pressed?: boolean; disabled?: boolean; title?: string; name?: string; fold?: boolean; key?: string } = {},
): HTMLElement {
  const { pressed, disabled, title = action.label, name: word, fold, key } = options;
  return h(
    "button",
    {
      class: word ? "icon named" : "icon",
      "data-fold": fold ?? false,
      "data-key": key,
      title: withKey(title, action.keys[0] && shownKey(action.keys[0])),
      "aria-label": title,
      onclick: action.run,
      "aria-pressed": pressed === undefined ? null : String(pressed),
      disabled: disabled ?? false,
    },
    icon(name),
    word && h("span", { "aria-hidden": "true" }, word),
  );
}

export function textButton(
  text: string,
  run: () => void,
  options: { title?: string; disabled?: boolean; pressed?: boolean; strong?: boolean } = {},
): HTMLElement {
  const { title, disabled = false, pressed, strong } = options;
  return h(
    "button",
    {
      class: strong ? "text strong" : "text",
      title,
      disabled,
      onclick: run,
      "aria-pressed": pressed === undefined ? null : String(pressed),
    },
    text,
  );
}

export function section(title: string, ...children: (Node | string | null | undefined | false)[]): HTMLElement {
  return h("section", { "data-key": title }, h("h2", {}, title), ...children);
}

/** A number with its name and unit; changes are told when the user is done. */
export function numberField(
  name: string,
  value: number | null,
  unit: string,
  change: (value: number | null) => void,
  options: { min?: number; max?: number; step?: number; empty?: string } = {},
): HTMLElement {
  const { min, max, step = 0.05, empty = "" } = options;
  return h(
    "label",
    { class: "field" },
    h("span", {}, name),
    h(
      "span",
      { class: "value" },
      h("input", {
        type: "number",
        value: value === null ? "" : String(value),
        min,
        max,
        step,
        placeholder: empty,
        "aria-label": `${name}, ${unit}`,
        onchange: (event: Event) => {
          const { value: text } = event.target as HTMLInputElement;
          const found = Number(text);
          change(
            text === "" || !Number.isFinite(found)
              ? null
              : Math.min(Math.max(found, min ?? -Infinity), max ?? Infinity),
          );
        },
      }),
      h("em", {}, unit),
    ),
  );
}

/** A place to write what somebody does; `Enter` and `Escape` leave it. */
export function wordsArea(label: string, key: string, text: string, write: (text: string) => void): HTMLElement {
  return h(
    "textarea",
    {
      class: "words",
      rows: "2",
      "aria-label": label,
      placeholder: label,
      "data-key": key,
      maxlength: "2000",
      spellcheck: "true",
      oninput: (event: Event) => write((event.target as HTMLTextAreaElement).value),
      onkeydown: (event: KeyboardEvent) => {
        if (event.key !== "Escape" && (event.key !== "Enter" || event.shiftKey)) return;
        event.preventDefault();
        (event.target as HTMLElement).blur();
      },
    },
    text,
  );
}

/** "Ctrl+Z" as somebody reads it. */
export function shownKey(key: string): string {
  const names: Record<string, string> = {
    ArrowLeft: "←",
    ArrowRight: "→",
    ArrowUp: "↑",
    ArrowDown: "↓",
    Delete: "Del",
    Backspace: "⌫",
  };
  if (key === "+") return key;
  return key
    .split("+")
    .map((part) => names[part] ?? part)
    .join(" ");
}

/** Centimetres; red where something is farther away than `limit`. */
export function miss(centimetres: number | null, limit: number): HTMLElement {
  if (centimetres === null) return h("span", { class: "miss" }, "–");
  return h("span", { class: centimetres > limit ? "miss unmet" : "miss" }, `${centimetres.toFixed(1)} cm`);
}

/** What the server said about this part of the project. */
export function wrong(app: App, kind: Place["kind"], id?: string): HTMLElement | false {
  const { error } = app.session.value;
  const isHere = error?.at?.kind === kind && (!id || !("id" in error.at) || error.at.id === id);
  return isHere && h("p", { class: "unmet" }, error.message);
}
