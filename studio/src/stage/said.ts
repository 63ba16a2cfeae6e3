/** Over the heads of two people: who is asked to do what at the playhead. */

import * as THREE from "three";
import { type App, denoised, shownClip } from "../app/app";
import { h } from "../app/dom";
import { jointAt } from "../body/clip";
import { HEAD } from "../body/skeleton";
import { STANDS } from "../project/goals";
import { begins } from "../project/model";
import type { Scene } from "./scene";

/** Metres from the head's joint to its tag. */
const ABOVE = 0.32;
/** Pixels of the picture within which two tags would hide each other. */
const [WIDE, HIGH] = [200, 26];

export class Said {
  private readonly tags = [0, 1].map((who) =>
    h("span", { class: `tag who${who}`, "aria-hidden": "true", hidden: true }),
  );

  constructor(
    private readonly app: App,
    private readonly scene: Scene,
  ) {
    scene.canvas.parentElement!.append(...this.tags);
  }

  /** Put the words where the heads are in the picture. */
  tell(): void {
    const { time, sideBySide, fan } = this.app.session.value;
    const { people, segments } = this.app.project.value;
    const clip = denoised(this.app) ?? shownClip(this.app);
    const begun = begins(segments).filter((begin) => begin <= time + 1e-6).length;
    const one = segments[Math.min(begun, segments.length) - 1];
    const isTold = people.length > 1 && clip?.people.length === 2 && !sideBySide && !fan && !this.app.live.value;
    const box = this.scene.canvas.getBoundingClientRect();
    const heads = this.tags.map((_, who) => {
      const place = isTold && new THREE.Vector3(...jointAt(clip, who, HEAD, time));
      return place ? this.scene.onScreen(place.setY(place.y + ABOVE)) : ([0, 0, 2] as const);
    });
    const [first, second] = heads.map(([x, y]) => ({ x, y }));
    const isClose = Math.abs(first!.x - second!.x) < WIDE && Math.abs(first!.y - second!.y) < HIGH;
    this.tags.forEach((tag, who) => {
      const [x, y, depth] = heads[who]!;
      tag.hidden = !one || depth > 1;
      if (!one || tag.hidden) return;
      const said = (who === 1 && one.other.trim()) || one.text.trim() || STANDS;
      if (tag.textContent !== said) tag.textContent = said;
      // Where the heads are near each other, one tag is above the other.
      const top = isClose && who === 0 ? second!.y - HIGH : y;
      tag.style.transform = `translate(-50%, -100%) translate(${Math.round(x - box.left)}px, ${Math.round(top - box.top)}px)`;
    });
  }
}
