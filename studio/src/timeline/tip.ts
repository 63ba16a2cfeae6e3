/** What is to be said of the block under the pointer: how it was read, and what happens in it. */

import type { App } from "../app/app";
import { h } from "../app/dom";
import { eventsInBlock } from "../app/blockEvents";
import { notesOf } from "../project/goals";

/** Milliseconds that the pointer rests on a block before it is asked about. */
const REST = 200;

export function tips(app: App, blocks: HTMLElement): void {
  const tip = h("div", { class: "tip", role: "tooltip", hidden: true });
  document.body.append(tip);
  let over = "";
  let timer = 0;
  const hide = () => {
    clearTimeout(timer);
    over = "";
    tip.hidden = true;
  };
  const show = async (block: HTMLElement, id: string) => {
    const one = app.project.value.segments.find((segment) => segment.id === id);
    const lines = one
      ? [...(await eventsInBlock(app, one)), ...notesOf(app.project.value, one).map((note) => note.line)]
      : [];
    if (over !== id || !lines.length || !block.isConnected) return;
    tip.replaceChildren(...lines.map((line) => h("p", {}, line)));
    tip.hidden = false;
    const { left, top } = block.getBoundingClientRect();
    tip.style.left = `${Math.max(Math.min(left, innerWidth - tip.offsetWidth - 8), 8)}px`;
    tip.style.top = `${top - tip.offsetHeight - 6}px`;
  };
  blocks.addEventListener("pointerover", (event) => {
    const block = (event.target as HTMLElement).closest<HTMLElement>(".block");
    const id = block?.dataset.id ?? "";
    if (id === over) return;
    hide();
    over = id;
    if (block) timer = window.setTimeout(() => void show(block, id), REST);
  });
  blocks.addEventListener("pointerleave", hide);
  blocks.addEventListener("pointerdown", hide);
  blocks.addEventListener("scroll", hide);
}
