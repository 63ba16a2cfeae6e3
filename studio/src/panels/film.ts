/** The film of the stage: what is chosen of it, how far it is, and the way to end it. */

import { type App, problemOf } from "../app/app";
import { h } from "../app/dom";
import { download, fileName } from "../app/files";
import { type FilmFormat, writeFilm } from "../server/film";
import { Filming, type Way, stretch } from "../stage/filming";
import type { Stage } from "../stage/stage";
import { dialog } from "./dialog";

const KEPT = "motionloom-film";
const SIZES = ["1280x720", "1920x1080", "1080x1080", "1080x1920", "640x360", "page"] as const;
/** A GIF has times in hundredths of a second. */
const FPS = { mp4: 30, gif: 20 } as const;

interface Chosen {
  readonly way: Way;
  readonly format: FilmFormat["format"];
  readonly size: (typeof SIZES)[number];
}

/** What a film of these choices is: every size is even, as encoders want it. */
export function filmOf(
  { format, size }: Pick<Chosen, "format" | "size">,
  [from, to]: readonly [number, number],
  page: readonly [number, number],
): FilmFormat {
  const [width, height] = size === "page" ? page : size.split("x").map(Number);
  const even = (pixels: number) => Math.max(Math.floor(pixels / 2) * 2, 64);
  const count = Math.max(Math.round((to - from) * FPS[format]), 2);
  return { format, width: even(width!), height: even(height!), fps: FPS[format], count };
}

export function filmDialog(app: App, stage: Stage): void {
  const way = choice("Camera", { kept: "As it is", around: "Once around the person" });
  const format = choice("File", { mp4: "MP4", gif: "GIF, 20 pictures per second" });
  const size = choice("Size", Object.fromEntries(SIZES.map((one) => [one, named(one)])));
  const about = h("p", { class: "quiet" });
  const bar = h("progress", { "aria-label": "How far the film is" }) as HTMLProgressElement;
  const state = h("p", { class: "quiet", role: "status" });
  const write = h("button", { class: "text strong" }, "Write the film");
  let running: AbortController | null = null;

  const film = async () => {
    const { canvas } = stage.scene;
    const chosen = { way: way.value, format: format.value, size: size.value } as Chosen;
    localStorage.setItem(KEPT, JSON.stringify(chosen));
    const asked = filmOf(chosen, stretch(app), [canvas.clientWidth, canvas.clientHeight]);
    const now = (running = new AbortController());
    busy(true);
    const filming = new Filming(app, stage.scene, asked, chosen.way);
    const seen = (done: number) => {
      bar.value = done / asked.count;
      state.textContent = `Picture ${done + 1} of ${asked.count}`;
    };
    try {
      const file = await writeFilm(asked, (number) => filming.picture(number), seen, now.signal);
      download(file, `${fileName(app.project.value.name)}.${asked.format}`);
      if (running === now) app.session.update({ dialog: null });
    } catch (error) {
      if (!now.signal.aborted) state.textContent = problemOf(app, error).message;
    } finally {
      filming.end();
      if (running === now) running = null;
      busy(false);
    }
  };
  const busy = (is: boolean) => {
    bar.hidden = !is;
    bar.value = 0;
    for (const one of [way, format, size, write] as (HTMLSelectElement | HTMLButtonElement)[]) one.disabled = is;
    root.classList.toggle("filming", is);
  };
  const form = h(
    "form",
    {
      onsubmit: (event: Event) => {
        event.preventDefault();
        if (!running) void film();
      },
    },
    about,
    ...[way, format, size].map((one) => h("label", {}, one.getAttribute("aria-label"), one)),
    bar,
    state,
    h(
      "div",
      { class: "row end" },
      h("button", { class: "text", type: "button", onclick: () => app.session.update({ dialog: null }) }, "Cancel"),
      write,
    ),
  );
  const root = dialog(app, "film", "Film of the stage", () => {
    const kept = JSON.parse(localStorage.getItem(KEPT) ?? "{}") as Partial<Record<keyof Chosen, string>>;
    for (const [one, value] of [
      [way, kept.way],
      [format, kept.format],
      [size, kept.size],
    ] as const)
      if (value && [...one.options].some((option) => option.value === value)) one.value = value;
    const [from, to] = stretch(app);
    about.textContent = `${from.toFixed(2)} to ${to.toFixed(2)} s, as the stage shows it${
      app.session.value.range ? " (what is marked)" : ""
    }; no picture is left out, however long each takes.`;
    state.textContent = "";
    busy(false);
    return [form];
  });
  root.addEventListener("close", () => running?.abort());
}

function choice(label: string, options: Readonly<Record<string, string>>): HTMLSelectElement {
  const rows = Object.entries(options).map(([value, text]) => h("option", { value }, text));
  return h("select", { "aria-label": label }, ...rows) as HTMLSelectElement;
}

function named(size: (typeof SIZES)[number]): string {
  return size === "page" ? "As on this page" : size.replace("x", " × ");
}
