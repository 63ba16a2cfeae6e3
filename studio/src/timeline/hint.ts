/** What an empty track is for, as the button that begins it. */

import { h } from "../app/dom";
import { TOUCH } from "../app/keys";

/** `act`: the action that it runs; `key` is named where there are keys. */
export function hint(act: string, text: string, key: string): HTMLElement {
  return h("button", { class: "hint", "data-act": act, "data-key": `hint-${act}` }, text, !TOUCH && h("kbd", {}, key));
}
