/** The export menu: a `details` element, whose state is the browser's and outlives every new picture of the bar. */

import { h } from "../app/dom";
import type { Files } from "../app/files";

const EXPORTS = [
  ["bvh", "BVH", "Motion on the 22 joints, or on your character"],
  ["glb", "GLB", "For Blender, Godot and the web; on your character if there is one"],
  ["mp4", "MP4", "A film"],
  ["png", "PNG", "A sheet of poses"],
  ["npz", "NPZ", "Numbers for Python"],
  ["html", "Share", "One web page that plays the motion, without a network: send it"],
  ["share", "Share with your character", "The same, and your character plays it; its file goes along"],
  ["yaml", "Timeline (YAML)", "What the command line runs to the same motion"],
  ["project", "Project file", "Everything on this page"],
] as const;

/** `own`: whether there is a character of one's own. */
export function exportMenu(files: Files, own: boolean): HTMLElement {
  return h(
    "details",
    { class: "menu", "data-key": "export" },
    h("summary", { class: "text strong", "aria-label": "Export" }, "Export"),
    h(
      "div",
      { class: "sheet" },
      ...EXPORTS.filter(([format]) => own || format !== "share").map(([format, name, title]) =>
        h(
          "button",
          {
            class: "row",
            onclick: (event: Event) => {
              close((event.currentTarget as Element).closest("details"));
              void files.export(format);
            },
          },
          h("b", {}, name),
          h("small", {}, title),
        ),
      ),
    ),
  );
}

/** What menus in `root` do by keys, and that they close where somebody goes elsewhere. */
export function menuHabits(root: HTMLElement): void {
  const open = () => root.querySelector<HTMLDetailsElement>("details[open]");
  root.addEventListener("keydown", (event) => {
    const menu = open();
    if (!menu?.contains(event.target as Node)) return;
    const rows = [...menu.querySelectorAll("button")];
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
