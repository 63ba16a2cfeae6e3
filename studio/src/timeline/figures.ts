/** Small figures in the blocks: what the person does there, drawn on one canvas that lies over the row of words. */

import { type App, shownClip } from "../app/app";
import { h } from "../app/dom";
import { type Ink, figure, inks, yawOf } from "../body/figure";
import { POSE, poseAt } from "../body/clip";
import { begins } from "../project/model";

/** Pixels of a picture, and those between two. */
const HEIGHT = 40;
const APART = 34;
/** Pixels that a block needs for one. */
const ROOM = 22;

export class Figures {
  readonly canvas = h("canvas", {
    class: "figures",
    "data-key": "figures",
    "aria-hidden": "true",
  }) as HTMLCanvasElement;
  private readonly pose = new Float32Array(POSE);
  private colors: readonly Ink[] = [];
  private key = "";
  private next = 0;

  constructor(
    private readonly app: App,
    private readonly scroll: HTMLElement,
    private readonly scale: () => number,
  ) {
    scroll.addEventListener("scroll", () => this.later());
    new ResizeObserver(() => this.later()).observe(scroll);
  }

  /** Draw with the next picture of the page what is seen then. */
  later(): void {
    cancelAnimationFrame(this.next);
    this.next = requestAnimationFrame(() => this.draw());
  }

  private draw(): void {
    const clip = shownClip(this.app);
    const { segments } = this.app.project.value;
    const { scrollLeft, clientWidth } = this.scroll;
    const scale = this.scale();
    const theme = document.documentElement.dataset.theme;
    const lengths = segments.map((one) => one.seconds).join();
    const key = [clip && Figures.number(clip), scrollLeft, clientWidth, scale, theme, lengths].join("|");
    this.canvas.style.transform = `translateX(${scrollLeft}px)`;
    if (key === this.key || !clientWidth) return;
    this.key = key;
    this.colors = inks();
    const ratio = Math.min(devicePixelRatio, 2);
    [this.canvas.width, this.canvas.height] = [Math.round(clientWidth * ratio), Math.round(HEIGHT * ratio)];
    this.canvas.style.width = `${clientWidth}px`;
    const context = this.canvas.getContext("2d")!;
    context.scale(ratio, ratio);
    if (!clip) return;
    const at = begins(segments);
    segments.forEach((_, index) => {
      const [from, to] = [at[index]! * scale, Math.min(at[index + 1]!, clip.seconds) * scale];
      if (to - from < ROOM) return;
      const count = Math.max(Math.floor((to - from - 8) / APART), 1);
      for (let number = 0; number < count; number += 1) {
        const x = from + ((number + 0.5) * (to - from)) / count;
        if (x > scrollLeft - APART && x < scrollLeft + clientWidth + APART) this.drawAt(context, x, scrollLeft);
      }
    });
  }

  private drawAt(context: CanvasRenderingContext2D, x: number, scrollLeft: number): void {
    const clip = shownClip(this.app)!;
    clip.people.forEach((_, person) => {
      poseAt(clip, person, x / this.scale(), this.pose);
      const place = { x: x - scrollLeft + person * 9, floor: HEIGHT - 1, height: HEIGHT };
      figure(context, this.pose, yawOf(clip, person), place, this.colors[person % this.colors.length]!);
    });
  }

  private static readonly numbers = new WeakMap<object, number>();
  private static count = 0;

  /** A number that no other motion of this page has. */
  private static number(clip: object): number {
    if (!Figures.numbers.has(clip)) Figures.numbers.set(clip, ++Figures.count);
    return Figures.numbers.get(clip)!;
  }
}
