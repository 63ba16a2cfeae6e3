/** Shows takes: the stage, the bar under it, the curves, and what keys do. */

import { h, morph } from "../app/dom";
import { keyOf } from "../app/keys";
import { Signal } from "../app/signal";
import { iconButton, shownKey, textButton } from "../panels/parts";
import { Curves } from "./curves";
import type { Take } from "./data";
import { type Camera, ViewStage } from "./stage";
import { BEGINNING, RATES, type View } from "./view";

export interface Options {
  readonly dark: boolean;
  readonly playing: boolean;
  /** Where key presses are heard. */
  readonly keys: EventTarget;
  /** Licences of what the viewer is made of; empty: they are elsewhere. */
  readonly notices: string;
}

interface Deed {
  readonly label: string;
  readonly keys: readonly string[];
  readonly run: () => void;
}

export class Viewer {
  readonly view: Signal<View>;
  readonly stage: ViewStage;
  private readonly deeds: Record<string, Deed>;
  private readonly curves: Curves;
  private readonly canvas = h("canvas", { tabindex: "0" }) as HTMLCanvasElement;
  private readonly names = h("div", { class: "takes", role: "toolbar", "aria-label": "Takes" });
  private readonly cameras = h("div", { class: "strip", role: "toolbar", "aria-label": "View" });
  private readonly lines = h("section", { class: "curves", "aria-label": "Curves of a joint" });
  private readonly bar = h("div", { class: "bar", role: "toolbar", "aria-label": "Playback" });
  private readonly help = h("dialog", { "aria-label": "Keys" }) as HTMLDialogElement;
  private readonly clock = h("output", { class: "clock", "aria-label": "Time" });
  private readonly scrub: HTMLInputElement;
  private readonly heard = (event: Event) => this.press(event as KeyboardEvent);

  constructor(
    private readonly root: HTMLElement,
    private readonly takes: readonly Take[],
    private readonly options: Options,
  ) {
    const { dark, playing } = options;
    this.view = new Signal<View>({ ...BEGINNING, dark, playing });
    root.dataset.theme = dark ? "dark" : "light";
    this.scrub = h("input", {
      class: "scrub",
      type: "range",
      min: 0,
      step: "any",
      "aria-label": "Time in the motion",
      oninput: () => this.view.update({ time: Number(this.scrub.value), playing: false }),
    }) as HTMLInputElement;
    root.replaceChildren(
      h("div", { class: "stage" }, this.canvas, this.names, this.cameras),
      this.lines,
      this.bar,
      this.help,
    );
    this.stage = new ViewStage(this.canvas, takes, this.view);
    this.curves = new Curves(this.lines, this.view);
    this.deeds = this.all();
    this.fillHelp();
    this.view.subscribe((now, before) => this.changed(now, before));
    options.keys.addEventListener("keydown", this.heard);
    this.render();
  }

  /** Show nothing and hear nothing any more. */
  dispose(): void {
    this.options.keys.removeEventListener("keydown", this.heard);
    this.stage.scene.dispose();
    this.root.replaceChildren();
  }

  /** Seconds of the take that is shown. */
  get seconds(): number {
    return this.stage.take.seconds;
  }

  go(time: number): void {
    this.view.update({ time: Math.min(Math.max(time, 0), this.seconds), playing: false });
  }

  private all(): Record<string, Deed> {
    const { view } = this;
    const fps = () => this.stage.take.clip?.fps ?? 30;
    const flip = (key: keyof View) => () => view.update({ [key]: !view.value[key] } as Partial<View>);
    const look = (camera: Camera) => () => this.stage.look(camera);
    const frame = (step: number) => () => this.go((Math.round(view.value.time * fps()) + step) / fps());
    const faster = (step: number) => () => {
      const at = RATES.indexOf(view.value.rate as (typeof RATES)[number]);
      view.update({ rate: RATES[Math.min(Math.max(at + step, 0), RATES.length - 1)]! });
    };
    return {
      play: { label: "Play or pause", keys: ["Space", "K"], run: () => this.play() },
      back: { label: "One frame back", keys: ["ArrowLeft"], run: frame(-1) },
      on: { label: "One frame on", keys: ["ArrowRight"], run: frame(1) },
      secondBack: { label: "One second back", keys: ["Shift+ArrowLeft"], run: () => this.go(view.value.time - 1) },
      secondOn: { label: "One second on", keys: ["Shift+ArrowRight"], run: () => this.go(view.value.time + 1) },
      first: { label: "To the beginning", keys: ["Home"], run: () => this.go(0) },
      last: { label: "To the end", keys: ["End"], run: () => this.go(this.seconds) },
      slower: { label: "Slower", keys: ["["], run: faster(-1) },
      faster: { label: "Faster", keys: ["]"], run: faster(1) },
      repeat: { label: "Play again and again", keys: ["Y"], run: flip("repeat") },
      around: { label: "Look from where it began", keys: ["V"], run: look("around") },
      front: { label: "Look from the front", keys: ["F"], run: look("front") },
      side: { label: "Look from the side", keys: ["S"], run: look("side") },
      above: { label: "Look from above", keys: ["X"], run: look("above") },
      follow: { label: "Camera follows", keys: ["C"], run: flip("follow") },
      trails: { label: "Trails", keys: ["I"], run: flip("trails") },
      ghosts: { label: "Ghosts of the other takes", keys: ["H"], run: flip("ghosts") },
      curves: { label: "Curves of a joint", keys: ["G"], run: flip("curves") },
      theme: { label: "Dark or light", keys: ["Shift+D", "D"], run: flip("dark") },
      help: { label: "Keys", keys: ["?", "F1"], run: flip("help") },
    };
  }

  private play(): void {
    const { playing, time } = this.view.value;
    const isOver = !playing && time >= this.seconds;
    this.view.update({ playing: !playing, ...(isOver ? { time: 0 } : {}) });
  }

  private press(event: KeyboardEvent): void {
    const target = event.composedPath()[0];
    if (target instanceof HTMLSelectElement || event.defaultPrevented) return;
    const isButton = target instanceof HTMLElement && target.matches("button, summary");
    const key = keyOf(event);
    if (isButton && (key === "Space" || key === "Enter")) return;
    const number = Number(key) - 1;
    const deed = Object.values(this.deeds).find((one) => one.keys.includes(key));
    if (/^[1-9]$/.test(key) && number < this.takes.length) this.choose(number);
    else if (deed) deed.run();
    else return;
    event.preventDefault();
  }

  private choose(take: number): void {
    const { seconds } = this.takes[take]!;
    this.view.update({ take, time: Math.min(this.view.value.time, seconds) });
  }

  private changed(now: View, before: View): void {
    const isOther = (Object.keys(now) as (keyof View)[]).some((key) => key !== "time" && now[key] !== before[key]);
    if (now.dark !== before.dark) this.stage.theme(now.dark);
    if (now.help !== before.help && now.help) this.help.showModal();
    if (isOther) {
      this.stage.shown();
      this.render();
    } else {
      this.stage.place();
      this.tick();
    }
  }

  /** What the time alone changes. */
  private tick(): void {
    const { time, curves } = this.view.value;
    this.scrub.value = String(time);
    this.clock.textContent = `${time.toFixed(2)} / ${this.seconds.toFixed(2)} s`;
    if (curves) this.curves.at(time);
  }

  private render(): void {
    const { take, playing, repeat, rate, follow, trails, ghosts, curves, dark } = this.view.value;
    const { deeds, takes } = this;
    const clip = this.stage.take.clip;
    this.root.dataset.theme = dark ? "dark" : "light";
    this.canvas.setAttribute("aria-label", `${this.stage.take.name || "The motion"}; drag to look around`);
    this.scrub.max = String(this.seconds);
    morph(
      this.names,
      takes.map(({ name }, index) =>
        takes.length > 1
          ? textButton(name || `take ${index + 1}`, () => this.choose(index), { pressed: index === take, title: name })
          : h("span", { class: "ellipsis" }, name),
      ),
    );
    morph(this.cameras, [
      ...(["around", "front", "side", "above"] as const).map((name) => iconButton(deeds[name]!, name)),
      iconButton(deeds.follow!, "follow", { pressed: follow }),
    ]);
    morph(this.bar, [
      iconButton(deeds.play!, playing ? "pause" : "play", { title: playing ? "Pause" : "Play" }),
      this.scrub,
      this.clock,
      h(
        "button",
        {
          class: "text rate",
          title: "Playback rate ([ and ])",
          "aria-label": `Playback rate ${rate}`,
          onclick: () => this.view.update({ rate: RATES[(RATES.indexOf(rate as never) + 1) % RATES.length]! }),
        },
        `${rate}×`,
      ),
      iconButton(deeds.repeat!, "repeat", { pressed: repeat }),
      ...(clip ? [iconButton(deeds.trails!, "trails", { pressed: trails })] : []),
      ...(takes.length > 1 && clip ? [iconButton(deeds.ghosts!, "ghosts", { pressed: ghosts })] : []),
      ...(clip ? [iconButton(deeds.curves!, "curves", { pressed: curves })] : []),
      iconButton(deeds.theme!, "theme"),
      iconButton(deeds.help!, "help"),
    ]);
    this.lines.hidden = !curves || !clip;
    if (curves) this.curves.show(clip);
    this.tick();
  }

  private fillHelp(): void {
    const close = () => this.help.close();
    this.help.addEventListener("close", () => this.view.update({ help: false }));
    const rows = Object.values(this.deeds).flatMap(({ keys, label }) => [
      h("dt", {}, h("kbd", {}, shownKey(keys[0]!))),
      h("dd", {}, label),
    ]);
    const many = this.takes.length > 1 && [
      h("dt", {}, h("kbd", {}, "1"), " … ", h("kbd", {}, "9")),
      h("dd", {}, "Show a take"),
    ];
    const { notices } = this.options;
    this.help.append(
      h("header", {}, h("h2", {}, "Keys"), h("button", { class: "icon", "aria-label": "Close", onclick: close }, "×")),
      h("dl", {}, ...rows, ...(many || [])),
      h("p", { class: "quiet" }, "Drag to look around, wheel or two fingers to come nearer, right button to move."),
      notices ? h("details", {}, h("summary", {}, "Made with motionloom; licences"), h("pre", {}, notices)) : "",
    );
  }
}
