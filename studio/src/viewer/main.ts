/** The page that plays one file's motions: what stands in it, shown. */

import "../style/colors.css";
import "../style/buttons.css";
import "./viewer.css";
import { h } from "../app/dom";
import { type MotionJson, takesOf } from "./data";
import { Viewer } from "./viewer";

const text = (id: string): string => document.getElementById(id)?.textContent ?? "";

async function start(): Promise<void> {
  const root = document.getElementById("viewer")!;
  const dark = matchMedia("(prefers-color-scheme: dark)").matches;
  root.dataset.theme = dark ? "dark" : "light";
  try {
    const takes = await takesOf(JSON.parse(text("motion")) as MotionJson);
    const playing = !matchMedia("(prefers-reduced-motion: reduce)").matches;
    new Viewer(root, takes, { dark, playing, keys: window, notices: text("notices").trim() });
    document.body.dataset.ready = "true";
  } catch (error) {
    root.replaceChildren(
      h("p", { class: "problem", role: "alert" }, `This motion cannot be shown: ${(error as Error).message}`),
    );
  }
}

void start();
