/** The same people from the front and the side, or from above, beside the main picture. */

import * as THREE from "three";
import type { Views } from "../app/session";
import { h } from "../app/dom";
import type { Vec3 } from "../project/model";
import type { Scene } from "./scene";

/** The part of the picture's width that the two views have. */
export const BESIDE = 0.3;
/** Metres that a view shows at least, and room around people who are apart. */
const [TALL, ROOM] = [2.3, 1.4];
/** Where each looks from; a person who faces +Z is seen from the front. */
const FROM = { front: [0, 0, 12], side: [12, 0, 0], above: [0, 12, 0] } as const;
const NAMES = { front: "Front", side: "Side", above: "Above" } as const;

export class SplitView {
  private readonly camera = new THREE.OrthographicCamera();
  private readonly labels = [0, 1].map(() => h("span", { class: "view", hidden: true }));

  constructor(private readonly scene: Scene) {
    scene.canvas.after(...this.labels);
  }

  /** Show two views, or none; the main picture is then in the middle of what is left of it. */
  show(views: Views): void {
    this.labels.forEach((label, n) => {
      label.hidden = views === null;
      if (views) label.textContent = NAMES[n ? views : "front"];
    });
    this.scene.aside(views ? BESIDE : 0);
  }

  /** The main picture, and the views of the places where people are over it. */
  paint(views: NonNullable<Views>, people: readonly Vec3[]): void {
    const { renderer, scene, camera } = this.scene;
    const { x: width, y: height } = renderer.getSize(new THREE.Vector2());
    renderer.render(scene, camera);
    const { background } = scene;
    scene.background = null; // a picture is behind the main one alone
    renderer.setScissorTest(true);
    const box = new THREE.Box3().setFromPoints(people.map((place) => new THREE.Vector3(...place)));
    const [middle, size] = [box.getCenter(new THREE.Vector3()), box.getSize(new THREE.Vector3())];
    (["front", views] as const).forEach((view, n) => {
      const [w, high] = [width * BESIDE, height / 2];
      const metres = Math.max(TALL, Math.hypot(size.x, size.z) + ROOM);
      const half = (metres / 2) * Math.max(1, high / w);
      Object.assign(this.camera, { left: (-half * w) / high, right: (half * w) / high, top: half, bottom: -half });
      this.camera.updateProjectionMatrix();
      const target = middle.clone().setY(view === "above" ? 0 : Math.max(middle.y, 0.9));
      this.camera.position.copy(target).add(new THREE.Vector3(...FROM[view]));
      this.camera.up.set(0, view === "above" ? 0 : 1, view === "above" ? -1 : 0);
      this.camera.lookAt(target);
      const y = n ? 0 : high;
      renderer.setViewport(width - w, y, w, high);
      renderer.setScissor(width - w, y, w + 2, high + 1);
      renderer.render(scene, this.camera);
    });
    scene.background = background;
    renderer.setScissorTest(false);
    renderer.setViewport(0, 0, width, height);
  }
}
