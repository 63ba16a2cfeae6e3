/** Targets: a joint is picked on the body and dragged with a gizmo, and the pose that this asks for is shown. */

import * as THREE from "three";
import { TransformControls } from "three/addons/controls/TransformControls.js";
import { type App, shownClip } from "../app/app";
import { POSE, poseAt, vec } from "../body/clip";
import { reach } from "../body/reach";
import { TARGETS } from "../body/skeleton";
import { putTarget, targetAt } from "../project/asks";
import { isMeasurable, isUnmet } from "../project/misses";
import { type Vec3, newId, toFrame } from "../project/model";
import type { Cast } from "./cast";
import { Line } from "./lines";
import type { Scene } from "./scene";
import type { StageTheme } from "./theme";

const GRAB = 18;
const DOT = new THREE.SphereGeometry(0.026, 16, 12);
/** The body has to move by more than this for a limb to get there: the preview says so. */
const TOO_FAR = 0.02;

export class TargetTool {
  private readonly proxy = new THREE.Object3D();
  private readonly gizmo: TransformControls;
  private readonly dots: THREE.Mesh[];
  private readonly marks = new THREE.Group();
  private readonly pose = new Float32Array(POSE);
  private dragging = "";

  constructor(
    private readonly app: App,
    private readonly scene: Scene,
    private readonly cast: Cast,
    private theme: StageTheme,
  ) {
    this.gizmo = new TransformControls(scene.camera, scene.canvas);
    this.gizmo.setSize(0.62);
    this.gizmo.attach(this.proxy);
    this.gizmo.addEventListener("dragging-changed", ({ value }) => this.drag(Boolean(value)));
    this.gizmo.addEventListener("objectChange", () => this.ask(true));
    this.gizmo.addEventListener("change", () => scene.invalidate());
    this.dots = TARGETS.map(
      () => new THREE.Mesh(DOT, new THREE.MeshBasicMaterial({ depthTest: false, transparent: true })),
    );
    for (const dot of this.dots) dot.renderOrder = 3;
    scene.scene.add(this.proxy, this.gizmo.getHelper(), this.marks, ...this.dots);
    this.update();
  }

  get busy(): boolean {
    return this.dragging !== "" || (this.gizmo.axis !== null && this.isOn());
  }

  look(theme: StageTheme): void {
    this.theme = theme;
    this.update();
  }

  /** Bring dots, gizmo and marks up to the project and the playhead. */
  update(): void {
    const { joint, person, time } = this.app.session.value;
    const clip = shownClip(this.app);
    const on = this.isOn() && clip !== null;
    this.gizmo.enabled = on;
    this.gizmo.getHelper().visible = on;
    this.dots.forEach((dot) => (dot.visible = on));
    this.drawMarks();
    if (!on) return this.cast.showAsked(null);
    poseAt(clip, person, time, this.pose);
    this.dots.forEach((dot, index) => {
      dot.position.set(...vec(this.pose, TARGETS[index]!));
      const material = dot.material as THREE.MeshBasicMaterial;
      material.color.set(TARGETS[index] === joint ? this.theme.path[person]! : this.theme.label);
      material.opacity = TARGETS[index] === joint ? 1 : 0.65;
    });
    if (this.dragging) return;
    const target = targetAt(this.app.project.value, person, joint, time);
    this.proxy.position.set(...(target?.position ?? vec(this.pose, joint)));
    this.preview(target?.position ?? null);
  }

  /** True: a joint was picked. */
  press(event: PointerEvent): boolean {
    if (!this.isOn() || this.gizmo.axis !== null) return this.isOn() && this.gizmo.axis !== null;
    let [best, nearest] = [-1, GRAB];
    this.dots.forEach((dot, index) => {
      const [x, y] = this.scene.onScreen(dot.position);
      const distance = Math.hypot(event.clientX - x, event.clientY - y);
      if (distance < nearest) [best, nearest] = [index, distance];
    });
    if (best < 0) return false;
    this.choose(TARGETS[best]!);
    return true;
  }

  /** Where the gizmo is on the screen, for scripts. */
  tell(): void {
    this.scene.tell("gizmo", this.isOn() ? this.scene.onScreen(this.proxy.position) : null);
  }

  choose(joint: number): void {
    const { person, time } = this.app.session.value;
    const target = targetAt(this.app.project.value, person, joint, time);
    this.app.session.update({ joint, selection: target ? { kind: "target", id: target.id } : { kind: "none" } });
  }

  /** Move the joint's target by metres, from the keyboard. */
  nudge(x: number, y: number, z: number): void {
    const { x: px, y: py, z: pz } = this.proxy.position;
    this.proxy.position.set(px + x, Math.max(py + y, 0), pz + z);
    this.dragging = `nudge:${this.app.session.value.joint}`;
    this.ask(false);
    this.dragging = "";
    this.update();
  }

  private isOn(): boolean {
    const { tool, playing, sideBySide } = this.app.session.value;
    return tool === "target" && !playing && !sideBySide;
  }

  private drag(on: boolean): void {
    this.scene.orbit.enabled = !on;
    if (on) {
      this.dragging = `target:${newId()}`;
      return;
    }
    this.ask(false);
    this.dragging = "";
    this.update();
  }

  /** Put the target where the proxy is. */
  private ask(draft: boolean): void {
    if (!this.dragging) return;
    const { joint, person, time } = this.app.session.value;
    const { x, y, z } = this.proxy.position;
    const position: Vec3 = [x, Math.max(y, 0), z];
    const at = toFrame(time);
    const id = newId();
    this.app.project.change("ask for a joint", (old) => putTarget(old, person, joint, at, position, id), {
      merge: this.dragging,
      draft,
    });
    const target = targetAt(this.app.project.value, person, joint, at);
    if (target) this.app.session.update({ selection: { kind: "target", id: target.id } });
    this.preview(position);
  }

  private preview(target: Vec3 | null): void {
    const clip = shownClip(this.app);
    const { joint, person, time } = this.app.session.value;
    if (!target || !clip) return this.cast.showAsked(null);
    const reached = reach(poseAt(clip, person, time, this.pose), joint, target);
    const there = vec(this.pose, joint);
    const isThere = Math.hypot(there[0] - target[0], there[1] - target[1], there[2] - target[2]) < 0.03;
    this.cast.showAsked(isThere ? null : reached.pose, reached.moved < TOO_FAR);
  }

  /** Every target as a small diamond, red where it was not met, with a line to where the joint is at that time. */
  private drawMarks(): void {
    const { project, session } = this.app;
    const clip = shownClip(this.app);
    this.marks.clear();
    if (session.value.sideBySide) return;
    project.value.people.forEach((person, who) => {
      for (const target of person.targets) {
        const bad = isMeasurable(project.value, clip) && isUnmet(clip, who, target);
        const color = bad ? this.theme.unmet : this.theme.path[who]!;
        const mark = new THREE.Mesh(new THREE.OctahedronGeometry(0.035), new THREE.MeshBasicMaterial({ color }));
        mark.position.set(...target.position);
        this.marks.add(mark);
        if (!bad || !clip) continue;
        const line = new Line(color, 1.5);
        const at = poseAt(clip, who, target.time, new Float32Array(POSE));
        line.through([target.position, vec(at, target.joint)]);
        this.marks.add(line.object);
      }
    });
  }
}
