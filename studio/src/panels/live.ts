/** Live mode in the timeline's place: what is done, a box for words, the keys, and the one that keeps it. */

import type { App } from "../app/app";
import { h, morph } from "../app/dom";
import { TOUCH, withKey } from "../app/keys";
import { LIVE_WORDS, type Live } from "../app/live";
import { textButton } from "./parts";

export function livePanel(app: App, live: Live, root: HTMLElement): void {
  let written = "";
  const say = (event: Event) => {
    event.preventDefault();
    const input = root.querySelector("input")!;
    if (written.trim()) live.say(written.trim());
    written = "";
    render();
    input.blur();
  };
  const render = () => {
    const state = app.live.value;
    root.hidden = state === null;
    if (!state) return morph(root, []);
    const done = state.connected ? state.words || "waiting for words" : "connecting …";
    morph(root, [
      h(
        "div",
        { class: "row" },
        h("b", { class: "grow ellipsis", role: "status" }, done),
        h("small", { class: "quiet" }, `${state.seconds.toFixed(1)} s`),
        textButton("Keep it", () => void live.keep(), {
          title: withKey("Put everything onto the timeline", "R"),
          strong: true,
          disabled: state.seconds < 0.5,
        }),
        textButton("Leave", () => live.leave(), { title: withKey("Leave live mode", "Escape") }),
      ),
      h(
        "form",
        { onsubmit: say },
        h("input", {
          type: "text",
          placeholder: "Say what happens now",
          "aria-label": "What the person does now",
          maxlength: "500",
          value: written,
          oninput: (event: Event) => (written = (event.target as HTMLInputElement).value),
        }),
      ),
      h(
        "div",
        { class: "row wrap" },
        ...LIVE_WORDS.map((words, index) =>
          textButton(`${TOUCH ? "" : `${index + 1} `}${words.replace(/^a person /, "")}`, () => live.say(words), {
            pressed: state.words === words,
          }),
        ),
        textButton(TOUCH ? "as steered" : "0 as steered", () => live.say("")),
      ),
      h(
        "p",
        { class: state.problem ? "unmet" : "quiet" },
        state.problem ||
          (TOUCH
            ? "A press on the floor sends there; a gamepad goes, too."
            : "W A S D or a gamepad goes, Shift runs, Q E turn the view, a click on the floor sends there."),
      ),
    ]);
  };
  app.live.subscribe(render);
  render();
}
