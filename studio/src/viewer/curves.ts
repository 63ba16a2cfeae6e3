/** How high, how far or how fast a joint is at every time, as lines; a press on them moves the playhead. */

import { h, morph, svg } from "../app/dom";
import type { Signal } from "../app/signal";
import { type MotionClip, jointAt } from "../body/clip";
import { JOINTS, jointName } from "../body/skeleton";
import type { View } from "./view";

export const MEASURES = ["height", "x", "z", "speed"] as const;
export type Measure = (typeof MEASURES)[number];

const UNITS: Record<Measure, string> = { height: "m", x: "m", z: "m", speed: "m/s" };
const AXES: Record<Exclude<Measure, "speed">, number> = { x: 0, height: 1, z: 2 };
/** Points of a line at most. */
const MOST = 800;

/** The measure of a joint at every frame. */
export function curve(clip: MotionClip, person: number, joint: number, measure: Measure): number[] {
  const places = Array.from({ length: clip.frames }, (_, frame) => jointAt(clip, person, joint, frame / clip.fps));
  if (measure !== "speed") return places.map((place) => place[AXES[measure]]!);
  return places.map((_, frame) => {
    const [a, b] = [Math.max(frame - 1, 0), Math.min(frame + 1, clip.frames - 1)];
    const [from, to] = [places[a]!, places[b]!];
    return b > a ? (Math.hypot(to[0] - from[0], to[1] - from[1], to[2] - from[2]) / (b - a)) * clip.fps : 0;
  });
}

export class Curves {
  private readonly plot = svg("svg", { class: "plot", viewBox: "0 0 1000 100", preserveAspectRatio: "none" });
  private readonly head = svg("line", { class: "head", y1: 0, y2: 100, "vector-effect": "non-scaling-stroke" });
  private readonly now = h("output", { class: "quiet", "aria-label": "Value at this time" });
  private lines: number[][] = [];
  private seconds = 1;
  private unit = "m";

  constructor(
    private readonly root: HTMLElement,
    private readonly view: Signal<View>,
  ) {
    const seek = (event: PointerEvent) => {
      const box = this.plot.getBoundingClientRect();
      view.update({ time: (Math.min(Math.max(event.clientX - box.left, 0), box.width) / box.width) * this.seconds });
    };
    this.plot.addEventListener("pointerdown", (event) => {
      this.plot.setPointerCapture(event.pointerId);
      seek(event);
    });
    this.plot.addEventListener("pointermove", (event) => event.buttons && seek(event));
  }

  /** The lines of what is chosen. */
  show(clip: MotionClip | null): void {
    const { joint, measure } = this.view.value;
    this.lines = clip ? clip.people.map((_, person) => curve(clip, person, joint, measure)) : [];
    this.seconds = clip?.seconds ?? 1;
    this.unit = UNITS[measure];
    const [low, high] = this.lines
      .flat()
      .reduce(([a, b], v) => [Math.min(a, v), Math.max(b, v)], [Infinity, -Infinity]);
    const room = Math.max((high - low) * 0.08, 0.01);
    const y = (value: number) => 100 - ((value - low + room) / (high - low + 2 * room)) * 100;
    morph(this.root, [
      h(
        "div",
        { class: "chosen" },
        select(
          "Joint",
          JOINTS.map((_, n) => [String(n), jointName(n)]),
          String(joint),
          (value) => this.view.update({ joint: Number(value) }),
        ),
        select(
          "Measure",
          MEASURES.map((one) => [one, one]),
          measure,
          (value) => this.view.update({ measure: value as Measure }),
        ),
        this.now,
      ),
      this.plot,
      h(
        "div",
        { class: "ends quiet" },
        h("span", {}, `${high.toFixed(2)} ${this.unit}`),
        h("span", {}, low.toFixed(2)),
      ),
    ]);
    this.plot.replaceChildren(
      ...this.lines.map((line, person) => {
        const step = Math.ceil(line.length / MOST);
        const points = line
          .flatMap((value, n) =>
            n % step === 0 ? [`${((n / Math.max(line.length, 1)) * 1000).toFixed(1)},${y(value).toFixed(2)}`] : [],
          )
          .join(" ");
        return svg("polyline", { class: `line${person % 2}`, points, "vector-effect": "non-scaling-stroke" });
      }),
      this.head,
    );
    this.at(this.view.value.time);
  }

  at(time: number): void {
    const x = String((Math.min(time, this.seconds) / this.seconds) * 1000);
    this.head.setAttribute("x1", x);
    this.head.setAttribute("x2", x);
    const values = this.lines.map(
      (line) => line[Math.min(Math.round((time / this.seconds) * line.length), line.length - 1)]!,
    );
    this.now.textContent = `${values.map((value) => value.toFixed(2)).join(" / ")} ${this.unit}`;
  }
}

function select(
  name: string,
  options: readonly (readonly [string, string])[],
  chosen: string,
  choose: (value: string) => void,
): HTMLElement {
  return h(
    "select",
    {
      "aria-label": name,
      value: chosen,
      onchange: (event: Event) => choose((event.target as HTMLSelectElement).value),
    },
    ...options.map(([value, text]) => h("option", { value, selected: value === chosen }, text)),
  );
}
