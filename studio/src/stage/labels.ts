/** Labels over the heads of two people: the words of each at the playhead, on the page and in films. */

import * as THREE from "three";
import { type App, denoised, shownClip } from "../app/app";
import { h } from "../app/dom";
import { jointAt } from "../body/clip";
import { HEAD } from "../body/skeleton";
import { STANDS_STILL } from "../project/goals";
import { begins } from "../project/model";
import type { Scene } from "./scene";

/** Metres from the head's joint to its tag. */
const ABOVE = 0.32;
/** Pixels of the picture within which two tags would hide each other. */
const [WIDE, HIGH] = [200, 26];

/** Words, and the pixel at the middle of their lower edge. */
interface Tag {
  readonly label: string;
  readonly x: number;
  readonly y: number;
}

export class HeadLabels {
  private readonly tags = [0, 1].map((who) =>
    h("span", { class: `tag who${who}`, "aria-hidden": "true", hidden: true }),
  );

  constructor(
    private readonly app: App,
    private readonly scene: Scene,
  ) {
    scene.canvas.parentElement!.append(...this.tags);
    scene.over = (pen, width, height) =>
      this.over(width, height).forEach((one, who) => one && draw(pen, one, getComputedStyle(this.tags[who]!)));
  }

  /** Move the labels to the heads in the picture. */
  update(): void {
    const { clientWidth, clientHeight } = this.scene.canvas;
    this.over(clientWidth, clientHeight).forEach((one, who) => {
      const tag = this.tags[who]!;
      tag.hidden = one === null;
      if (!one) return;
      if (tag.textContent !== one.label) tag.textContent = one.label;
      tag.style.transform = `translate(-50%, -100%) translate(${Math.round(one.x)}px, ${Math.round(one.y)}px)`;
    });
  }

  /** What is over each head in a picture of so many pixels; null: nothing. */
  private over(width: number, height: number): (Tag | null)[] {
    const { time, sideBySide, fan } = this.app.session.value;
    const { people, segments } = this.app.project.value;
    const clip = denoised(this.app) ?? shownClip(this.app);
    const begun = begins(segments).filter((begin) => begin <= time + 1e-6).length;
    const one = segments[Math.min(begun, segments.length) - 1];
    if (!one || people.length < 2 || clip?.people.length !== 2 || sideBySide || fan || this.app.live.value)
      return [null, null];
    const [first, second] = [0, 1].map((who) => {
      const [x, y, z] = jointAt(clip, who, HEAD, time);
      const at = new THREE.Vector3(x, y + ABOVE, z).project(this.scene.camera);
      return { x: ((at.x + 1) / 2) * width, y: ((1 - at.y) / 2) * height, isSeen: at.z <= 1 };
    });
    // Where the heads are near each other, one tag is above the other.
    const isClose = Math.abs(first!.x - second!.x) < WIDE && Math.abs(first!.y - second!.y) < HIGH;
    if (isClose) first!.y = second!.y - HIGH;
    return [first!, second!].map(({ x, y, isSeen }, who) => {
      const label = (who === 1 && one.other.trim()) || one.text.trim() || STANDS_STILL;
      return isSeen ? { label, x, y } : null;
    });
  }
}

/** Draw a tag as the page shows it. */
function draw(pen: CanvasRenderingContext2D, { label, x, y }: Tag, look: CSSStyleDeclaration): void {
  const { fontSize, lineHeight, paddingTop, paddingLeft, borderLeftWidth, borderTopLeftRadius, maxWidth } = look;
  const [letters, up, inset, edge, round, most] = [
    lineHeight,
    paddingTop,
    paddingLeft,
    borderLeftWidth,
    borderTopLeftRadius,
    maxWidth,
  ].map(parseFloat);
  pen.save();
  pen.font = `${fontSize} ${look.fontFamily}`;
  let text = label;
  const room = most! - edge! - 2 * inset!;
  for (let n = label.length; pen.measureText(text).width > room && n > 0; n -= 1) text = `${label.slice(0, n)}…`;
  const [wide, high] = [pen.measureText(text).width + edge! + 2 * inset!, letters! + 2 * up!];
  pen.translate(Math.round(x - wide / 2), Math.round(y - high));
  pen.beginPath();
  pen.roundRect(0, 0, wide, high, round);
  pen.fillStyle = look.backgroundColor;
  pen.fill();
  pen.clip();
  pen.fillStyle = look.borderLeftColor;
  pen.fillRect(0, 0, edge!, high);
  pen.fillStyle = look.color;
  pen.textBaseline = "middle";
  pen.fillText(text, edge! + inset!, high / 2);
  pen.restore();
}
