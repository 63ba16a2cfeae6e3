/** What is behind the people: the colour of the theme, another colour, or a picture. */

import { type App, fail } from "../app/app";
import { h } from "../app/dom";
import { type Backdrop, NONE, storeBackdrop, storedBackdrop, pictureOf } from "../stage/backdrop";
import type { Scene } from "../stage/scene";
import { dialog } from "./dialog";
import { textButton } from "./parts";

export function backdropDialog(app: App, scene: Scene): void {
  const take = async (next: Backdrop | Promise<Backdrop>) => {
    try {
      const backdrop = await next;
      await scene.behind(backdrop);
      storeBackdrop(backdrop);
    } catch (error) {
      app.session.update({ dialog: null });
      fail(app, error, "Backdrop");
    }
  };
  const choose = () => {
    const input = h("input", { type: "file", accept: "image/*" }) as HTMLInputElement;
    input.addEventListener("change", () => {
      const file = input.files?.[0];
      if (file) void take(pictureOf(file).then((picture) => ({ color: null, picture })));
    });
    input.click();
  };
  const color = h("input", {
    type: "color",
    "aria-label": "Colour",
    oninput: () => void take({ color: color.value, picture: null }),
  }) as HTMLInputElement;
  dialog(app, "backdrop", "Behind the people", () => {
    color.value = storedBackdrop().color ?? `#${scene.color.getHexString()}`;
    return [
      h("p", { class: "quiet" }, "This browser keeps it; it is also in films of the stage."),
      h("label", {}, "Colour", color),
      h(
        "div",
        { class: "row" },
        textButton("Choose a picture", choose),
        textButton("As the theme", () => void take(NONE)),
      ),
    ];
  });
  const kept = storedBackdrop();
  if (kept.color ?? kept.picture) void take(kept);
}
