/** The page that needs no server: words to motion in the browser. */

import "../style/colors.css";
import "../style/base.css";
import "../style/buttons.css";
import "../style/panels.css";
import "./tab.css";
import { h, morph } from "../app/dom";
import { Signal } from "../app/signal";
import { icon } from "../panels/icons";
import { textButton } from "../panels/parts";
import type { Place } from "../prior/path";
import type { Segment } from "../prior/prior";
import { Artist } from "./artist";
import type { Character } from "./character";
import { exportButtons } from "./exports";
import {
  FIRST,
  LARGEST,
  LETTERS,
  LONGEST,
  MOST,
  type Project,
  SHORTEST,
  SHORTEST_OF_SEVERAL,
  ofAddress,
  toAddress,
} from "./link";
import { chosenFile, onDrop } from "./files";
import { readings, secondsInText } from "./numbers";
import { Player } from "./player";

const THEME = "motionloom-theme";
const FLOOR = "Draw a line on the floor, or set points: arrow keys, Enter; Enter twice ends";

const part = <T extends HTMLElement = HTMLElement>(id: string): T => document.getElementById(id) as T;
const root = document.documentElement;
const isDark = (): boolean => root.dataset.theme === "dark";

class Page {
  private readonly project = new Signal<Project>(FIRST);
  /** What the page says besides what is drawn, such as why a link was refused. */
  private readonly notice = new Signal("");
  private readonly artist = new Artist();
  private character: Character | null = null;
  private readonly player = new Player(part<HTMLCanvasElement>("canvas"), part("player"), isDark(), (points) =>
    this.onPath(points),
  );

  constructor() {
    this.open(true);
    addEventListener("hashchange", () => this.open());
    onDrop((file) => void this.own(file));
    this.project.subscribe((now) => {
      this.player.floor.show(now.path);
      this.show();
    });
    this.player.floor.show(this.project.value.path);
    this.notice.subscribe(() => this.show());
    this.artist.state.subscribe((now, before) => {
      this.player.working = now.progress !== null;
      if (now.sketch.length) this.player.show(now.sketch);
      else if (now.drawn && now.drawn !== before.drawn) this.showMotion();
      else if (before.sketch.length) this.player.show(now.drawn?.clips ?? [], now.drawn?.bodies);
      this.show();
    });
    this.player.take.subscribe(() => this.show());
    this.show();
  }

  /** What the address says, drawn; where it says nothing, at the beginning, what there is. */
  private open(begin = false): void {
    try {
      const found = ofAddress(location.hash) ?? (begin ? FIRST : null);
      if (!found || (!begin && toAddress(found) === toAddress(this.project.value))) return;
      this.notice.value = "";
      this.project.value = found;
      this.draw();
    } catch (error) {
      this.notice.value = (error as Error).message;
    }
  }

  private draw(): void {
    const { segments } = this.project.value;
    const least = segments.length > 1 ? SHORTEST_OF_SEVERAL : SHORTEST;
    if (segments.some((one) => !one.text.trim())) {
      this.notice.value = "A sentence is empty; say in words what the person does, or remove it.";
      return;
    }
    if (segments.some((one) => one.seconds < least)) {
      this.notice.value = `Each of several sentences takes ${least} s or more; make the short one longer.`;
      return;
    }
    this.notice.value = "";
    this.artist.draw(this.project.value);
  }

  private showMotion(): void {
    const { project, clips, bodies } = this.artist.state.value.drawn!;
    const old = this.project.value.weights;
    if (old && !project.weights.startsWith(old))
      this.notice.value = "This link was made with other weights; the motion is not the one that was sent.";
    this.player.take.value = Math.min(this.player.take.value, clips.length - 1);
    this.player.show(clips, bodies);
    if (toAddress({ ...this.project.value, weights: "" }) === toAddress({ ...project, weights: "" }))
      this.project.value = project;
    history.replaceState(null, "", `#${toAddress(project)}`);
  }

  private change(change: Partial<Project>): void {
    this.project.value = { ...this.project.value, ...change, weights: "" };
  }

  private segment(index: number, change: Partial<Segment> | null): void {
    const { segments } = this.project.value;
    this.change({
      segments: segments.flatMap((one, n) => (n !== index ? [one] : change ? [{ ...one, ...change }] : [])),
    });
  }

  private show(): void {
    const { progress, says, error, about, drawn, sketch, remark } = this.artist.state.value;
    const { segments, seed, takes } = this.project.value;
    const message = this.notice.value || error;
    morph(part("top"), [
      h("strong", { class: "brand" }, "motionloom"),
      h("span", { class: "quiet grow ellipsis" }, "in a tab: nothing is sent anywhere"),
      h(
        "button",
        { class: "icon", "aria-label": "Dark or light", title: "Dark or light", onclick: () => this.theme() },
        icon("theme"),
      ),
      h(
        "button",
        { class: "icon", "aria-label": "About this page", title: "About this page", onclick: () => this.help() },
        icon("help"),
      ),
    ]);
    morph(part("notices"), message ? [h("p", { class: "notice", role: "alert" }, message)] : []);
    morph(
      part("asked"),
      [
        ...segments.map((one, index) => this.sentence(one, index)),
        h(
          "div",
          { class: "line" },
          textButton("+ what comes next", () => this.more(), { disabled: segments.length >= MOST }),
        ),
        this.floor(),
        this.person(),
        h(
          "div",
          { class: "line" },
          number("Seed", seed, 0, LARGEST, 1, (value) => this.change({ seed: Math.round(value) })),
          textButton("other", () => this.another(), { title: "Draw with the next seed" }),
        ),
        h(
          "div",
          { class: "line" },
          h("span", { class: "quiet grow" }, "Takes"),
          ...[1, 4].map((count) =>
            textButton(count > 1 ? "four" : "one", () => this.change({ takes: count }), { pressed: takes === count }),
          ),
        ),
        h(
          "div",
          { class: "line" },
          textButton("Draw", () => this.draw(), { strong: true }),
          progress !== null && about && textButton("Stop", () => this.artist.stop(), { title: "Give it up" }),
        ),
        h("progress", {
          max: 1,
          value: progress ?? 0,
          class: progress === null ? "idle" : null,
          "aria-label": says || "Progress",
        }),
        h("p", { class: "quiet", id: "says", role: "status" }, says || (drawn ? "drawn" : about ? "ready" : "")),
        remark && h("p", { class: "quiet" }, remark),
        drawn && drawn.clips.length > 1 && this.choose(drawn.clips.length),
        ...this.numbers(),
        ...(drawn?.misses[this.player.take.value] ?? []).map((one) => h("p", { class: "quiet" }, `This take: ${one}.`)),
        ...(drawn
          ? exportButtons(
              drawn.bodies[this.player.take.value] ?? drawn.bodies[0]!,
              drawn.project,
              this.character,
              (sentence) => (this.notice.value = sentence),
            )
          : []),
        h("p", { class: "quiet foot" }, "The address of this page holds the motion: copy it to share it."),
      ].filter((one): one is HTMLElement => one instanceof HTMLElement),
    );
    document.body.dataset.state = progress === null ? (drawn ? "drawn" : about ? "ready" : "failed") : "busy";
    document.body.dataset.shown = sketch.length ? "preview" : drawn ? "motion" : "nobody";
    document.body.dataset.threads = String(this.artist.state.value.threads);
    document.body.dataset.graphics = String(this.artist.state.value.graphics);
  }

  private sentence({ text, seconds }: Segment, index: number): HTMLElement {
    const name = `Sentence ${index + 1}`;
    const change = (event: Event): void => {
      const next = (event.target as HTMLTextAreaElement).value;
      const seconds = this.project.value.literal ? null : secondsInText(next);
      const least = this.project.value.segments.length > 1 ? SHORTEST_OF_SEVERAL : SHORTEST;
      const length = seconds !== null && seconds !== secondsInText(text) ? { seconds: Math.max(seconds, least) } : {};
      this.segment(index, { text: next, ...length });
    };
    const send = (event: KeyboardEvent): void => {
      if (event.key !== "Enter" || event.shiftKey) return;
      event.preventDefault();
      this.draw();
    };
    const words = h("textarea", { rows: 2, maxlength: LETTERS, "aria-label": name, oninput: change, onkeydown: send });
    (words as HTMLTextAreaElement).value = text;
    return h(
      "div",
      { class: "sentence" },
      words,
      h(
        "div",
        { class: "line" },
        number("Seconds", seconds, SHORTEST, LONGEST, 0.5, (value) =>
          this.segment(index, { seconds: Math.round(value * 20) / 20 }),
        ),
        h("span", { class: "grow" }),
        this.project.value.segments.length > 1 &&
          textButton("remove", () => this.segment(index, null), { title: `Remove sentence ${index + 1}` }),
      ),
    );
  }

  /** What is read of numbers in the words, and whether it is kept. */
  private numbers(): HTMLElement[] {
    const { segments, literal, path } = this.project.value;
    const found = readings(segments, path.length > 0);
    const leave = (): void => this.change({ literal: !literal });
    const button = textButton("as numbers", leave, {
      pressed: !literal,
      title: "Keep to the numbers in the words, or leave them to the network",
    });
    const summary = `${literal ? "Left to the network" : "Read as"}: ${found.kept.join("; ")}`;
    return [
      ...(found.kept.length ? [h("div", { class: "line" }, h("span", { class: "quiet grow" }, summary), button)] : []),
      ...found.left.map((one) => h("p", { class: "quiet" }, one)),
    ];
  }

  private choose(count: number): HTMLElement {
    const { take, compare } = this.player;
    const buttons = Array.from({ length: count }, (_, n) =>
      textButton(String(n + 1), () => (take.value = n), { pressed: take.value === n, title: `Take ${n + 1}` }),
    );
    const toggle = (): void => {
      compare.value = !compare.value;
      this.show();
    };
    const beside = textButton("compare", toggle, { pressed: compare.value, title: "Show the other takes too" });
    return h(
      "div",
      { class: "line" },
      h("span", { class: "quiet" }, "Take"),
      ...buttons,
      h("span", { class: "grow" }),
      beside,
    );
  }

  /** The path on the floor: drawn, and taken away. */
  private floor(): HTMLElement {
    const { path } = this.project.value;
    const { floor } = this.player;
    const remove = (): void => {
      this.change({ path: [] });
      this.draw();
    };
    return h(
      "div",
      { class: "line" },
      h("span", { class: "quiet grow" }, floor.active ? FLOOR : path.length ? "Path" : "Path on the floor"),
      textButton(floor.active ? "Cancel" : path.length ? "Draw another" : "Draw a path", () => {
        if (floor.active) floor.stop(null);
        else floor.start();
        this.show();
      }),
      path.length > 0 && !floor.active && textButton("remove", remove, { title: "Remove the path" }),
    );
  }

  private onPath(points: readonly Place[] | null): void {
    if (points) {
      this.change({ path: points });
      this.draw();
    }
    this.show();
  }

  /** Who is moved: the plain figure or somebody's own character. */
  private person(): HTMLElement {
    const { character } = this;
    const choose = (): void =>
      chosenFile(".glb,.vrm", (file) => {
        void this.own(file);
      });
    return h(
      "div",
      { class: "line" },
      h("span", { class: "quiet grow ellipsis" }, character ? character.name : "Character: plain figure"),
      textButton(character ? "other" : "Own character", choose, { title: "Open a GLB or VRM file, or drop one" }),
      character && textButton("remove", () => this.play(null), { title: "Back to the plain figure" }),
    );
  }

  private async own(file: File): Promise<void> {
    try {
      const { Character } = await import("./character");
      this.play(await Character.open(file));
      this.notice.value = "";
    } catch (error) {
      this.notice.value = (error as Error).message;
    }
  }

  private play(character: Character | null): void {
    this.character = character;
    this.player.play(character);
    this.show();
  }

  private more(): void {
    const segments = this.project.value.segments.map((one) => ({
      ...one,
      seconds: Math.max(one.seconds, SHORTEST_OF_SEVERAL),
    }));
    this.change({ segments: [...segments, { text: "", seconds: 4 }] });
    [...document.querySelectorAll<HTMLTextAreaElement>(".sentence textarea")].at(-1)?.focus();
  }

  private another(): void {
    const { seed, takes } = this.project.value;
    this.change({ seed: (seed + takes) % LARGEST });
    this.draw();
  }

  private theme(): void {
    root.dataset.theme = isDark() ? "light" : "dark";
    localStorage.setItem(THEME, root.dataset.theme);
    this.player.look(isDark());
  }

  private help(): void {
    const { about, threads, graphics } = this.artist.state.value;
    const by = graphics ? "the graphics processor (WebGPU)" : `${threads} thread${threads === 1 ? "" : "s"}`;
    const dialog = part<HTMLDialogElement>("help");
    const link = (file: string, text: string): HTMLElement =>
      h("p", {}, h("a", { href: file, target: "_blank" }, text));
    dialog.replaceChildren(
      h("h2", {}, "motionloom in a tab"),
      h(
        "p",
        {},
        "Words become motion on this computer, by a small network that came with the page. It works without a network once it was loaded. Drag to look around, roll to come nearer, space plays and pauses.",
      ),
      h(
        "p",
        {},
        about
          ? `Weights ${about.name} ${about.weights.slice(0, 12)}; drawn with ${by}.`
          : "The weights are not there yet.",
      ),
      h("p", {}, about ? `${about.licence}. Made of: ${about.data}` : ""),
      link("third-party-notices.txt", "Notices of the works of others in this page"),
      link("onnxruntime-notices.txt", "Notices of the works of others in ONNX Runtime"),
      textButton("Close", () => dialog.close()),
    );
    dialog.showModal();
  }
}

function number(
  name: string,
  value: number,
  min: number,
  max: number,
  step: number,
  change: (value: number) => void,
): HTMLElement {
  const changed = (event: Event): void => {
    const field = event.target as HTMLInputElement;
    const typed = field.value === "" ? NaN : Number(field.value);
    const next = Number.isFinite(typed) ? Math.min(Math.max(typed, min), max) : value;
    field.value = String(next);
    change(next);
  };
  return h("label", {}, name, h("input", { type: "number", min, max, step, value: String(value), onchange: changed }));
}

root.dataset.theme =
  localStorage.getItem(THEME) ?? (matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light");
new Page();
if ("serviceWorker" in navigator)
  navigator.serviceWorker
    .register("sw.js")
    .then(() => navigator.serviceWorker.ready)
    .then(() => (document.body.dataset.offline = "true"))
    .catch(() => undefined); // without one the page needs the network the next time
