/** Windows over the page: one at a time, closed by Escape, by their cross, and by a press beside them. */

import type { App } from "../app/app";
import { h, morph } from "../app/dom";
import type { Dialog } from "../app/session";

/** A dialog that is open as long as the session says so; `fill` gives what is in it each time it opens. */
export function dialog(app: App, name: Dialog, title: string, fill: () => readonly Node[]): HTMLDialogElement {
  const close = () => app.session.update({ dialog: null });
  const body = h("div", { class: "body" });
  const root = h(
    "dialog",
    { id: name, "aria-label": title },
    h("header", {}, h("h2", {}, title), h("button", { class: "cross", "aria-label": "Close", onclick: close }, "×")),
    body,
  ) as HTMLDialogElement;
  root.addEventListener("close", () => app.session.value.dialog === name && close());
  root.addEventListener("pointerdown", (event) => event.target === root && close());
  app.session.subscribe((now, before) => {
    if (now.dialog === before.dialog) return;
    if (now.dialog === name) {
      morph(body, fill());
      root.showModal();
    } else if (root.open) root.close();
  });
  document.body.append(root);
  return root;
}
