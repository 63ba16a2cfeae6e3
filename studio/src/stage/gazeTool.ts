/** The point that somebody looks at, while it is selected: it is dragged, with a line from the head to it. */

import * as THREE from "three";
import { TransformControls } from "three/addons/controls/TransformControls.js";
import { type App, shownClip } from "../app/app";
import { jointAt } from "../body/clip";
import { HEAD } from "../body/skeleton";
import { OTHER, type Vec3, newId } from "../project/model";
import { changeTrack, trackOf } from "../project/tracks";
import { Line } from "./lines";
import type { Scene } from "./scene";
import type { StageTheme } from "./theme";

export class GazeTool {
  private readonly gizmo: TransformControls;
  private readonly point = new THREE.Mesh(new THREE.SphereGeometry(0.05, 16, 12), new THREE.MeshBasicMaterial());
  private readonly line: Line;
  private dragging = "";

  constructor(
    private readonly app: App,
    private readonly scene: Scene,
    private theme: StageTheme,
  ) {
    this.line = new Line(theme.path[0]!, 1.5, 0.6);
    this.gizmo = new TransformControls(scene.camera, scene.canvas);
    this.gizmo.setSize(0.62);
    this.gizmo.attach(this.point);
    this.gizmo.addEventListener("dragging-changed", ({ value }) => this.drag(Boolean(value)));
    this.gizmo.addEventListener("objectChange", () => this.ask(true));
    this.gizmo.addEventListener("change", () => scene.invalidate());
    scene.scene.add(this.point, this.gizmo.getHelper(), this.line.object);
  }

  look(theme: StageTheme): void {
    this.theme = theme;
    this.update();
  }

  update(): void {
    const at = this.place();
    const { person, time } = this.app.session.value;
    const clip = shownClip(this.app);
    const color = this.theme.path[person]!;
    this.gizmo.enabled = this.gizmo.getHelper().visible = this.point.visible = at !== null;
    this.line.through(at && clip ? [jointAt(clip, person, HEAD, time), at] : []);
    this.line.color(color);
    this.point.material.color.set(color);
    if (at && !this.dragging) this.point.position.set(...at);
  }

  /** Where the point is on the screen, for scripts. */
  reportPositions(): void {
    this.scene.report("gaze", this.gizmo.enabled ? this.scene.onScreen(this.point.position) : null);
  }

  private place(): Vec3 | null {
    const { selection, person, playing, sideBySide } = this.app.session.value;
    if (selection.kind !== "track" || playing || sideBySide) return null;
    const look = trackOf(this.app.project.value, person, selection.id)?.look;
    return look && look !== OTHER ? look : null;
  }

  private drag(on: boolean): void {
    this.scene.orbit.enabled = !on;
    if (on) this.dragging = `look:${newId()}`;
    else {
      this.ask(false);
      this.dragging = "";
      this.update();
    }
  }

  private ask(draft: boolean): void {
    const { selection, person } = this.app.session.value;
    if (!this.dragging || selection.kind !== "track") return;
    const look = this.point.position.toArray().map((one) => Math.round(one * 1000) / 1000) as [number, number, number];
    this.app.project.change("look elsewhere", (old) => changeTrack(old, person, selection.id, { look }), {
      merge: this.dragging,
      draft,
    });
  }
}
