/** Targets: a joint is picked on the body and dragged with a gizmo, and the pose that this asks for is shown. */

import * as THREE from "three";
import { TransformControls } from "three/addons/controls/TransformControls.js";
import { type App, shownClip } from "../app/app";
import { POSE, poseAt, vec } from "../body/clip";
import { moved } from "../body/posed";
import { reach } from "../body/reach";
import { TARGETS } from "../body/skeleton";
import { changePose, poseNear, setTarget, targetAt } from "../project/constraints";
import { isMeasurable, isUnmet } from "../project/misses";
import { type Pose, type Vec3, newId, toFrame } from "../project/model";
import type { Cast } from "./cast";
import { Line } from "./lines";
import type { Scene } from "./scene";
import type { StageTheme } from "./theme";

const GRAB = 18;
const DOT = new THREE.SphereGeometry(0.026, 16, 12);
const PIN = new THREE.BoxGeometry(0.05, 0.05, 0.05);
/** The body has to move by more than this for a limb to get there: the preview says so. */
const TOO_FAR = 0.02;

export class TargetTool {
  private readonly proxy = new THREE.Object3D();
  private readonly gizmo: TransformControls;
  private readonly dots: THREE.Mesh[];
  private readonly marks = new THREE.Group();
  private readonly pose = new Float32Array(POSE);
  private dragging = "";
  /** The selected pose as it was when a joint of it was taken. */
  private taken: readonly Vec3[] = [];

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
    const own = this.edited();
    if (own) this.pose.set(own.positions.flat());
    else poseAt(clip, person, time, this.pose);
    const { joints, pins } = this.app.session.value;
    this.dots.forEach((dot, index) => {
      const one = TARGETS[index]!;
      const isChosen = one === joint || (own !== null && joints.includes(one));
      dot.position.set(...vec(this.pose, one));
      dot.geometry = own && pins.includes(one) ? PIN : DOT;
      const material = dot.material as THREE.MeshBasicMaterial;
      material.color.set(isChosen ? this.theme.path[person]! : this.theme.label);
      material.opacity = isChosen ? 1 : 0.65;
    });
    if (own) this.cast.showAsked(this.pose, true);
    if (this.dragging) return;
    if (own) return void this.proxy.position.set(...own.positions[joint]!);
    const target = targetAt(this.app.project.value, person, joint, time);
    this.proxy.position.set(...(target?.position ?? vec(this.pose, joint)));
    this.preview(target?.position ?? null);
  }

  /** True: a joint was picked. */
  press(event: PointerEvent): boolean {
    // With Shift a joint under the gizmo's arrows is meant, not they.
    const isMore = event.shiftKey && this.edited() !== null;
    if (!this.isOn() || (this.gizmo.axis !== null && !isMore)) return this.isOn() && this.gizmo.axis !== null;
    let [best, nearest] = [-1, GRAB];
    this.dots.forEach((dot, index) => {
      const [x, y] = this.scene.onScreen(dot.position);
      const distance = Math.hypot(event.clientX - x, event.clientY - y);
      if (distance < nearest) [best, nearest] = [index, distance];
    });
    if (best < 0) return false;
    if (isMore) event.stopImmediatePropagation();
    this.choose(TARGETS[best]!, isMore);
    return true;
  }

  /** Where the gizmo and the joints are on the screen, for scripts. */
  reportPositions(): void {
    this.dots.forEach((dot, index) =>
      this.scene.report(`joint-${TARGETS[index]!}`, this.isOn() ? this.scene.onScreen(dot.position) : null),
    );
    this.scene.report("gizmo", this.isOn() ? this.scene.onScreen(this.proxy.position) : null);
  }

  /** `more`: of a pose, a joint more that moves with the others, or one less. */
  choose(joint: number, more = false): void {
    const { person, time, joint: last, joints } = this.app.session.value;
    if (this.edited()) {
      const others = [...new Set([...joints, last])];
      const isThere = others.includes(joint) && joint !== last;
      const kept = more ? (isThere ? others.filter((one) => one !== joint) : [...others, joint]) : [joint];
      return this.app.session.update({ joint: isThere && more ? last : joint, joints: kept });
    }
    const target = targetAt(this.app.project.value, person, joint, time);
    this.app.session.update({ joint, selection: target ? { kind: "target", id: target.id } : { kind: "none" } });
  }

  /** Let the chosen joints of the selected pose stay where they are while others are moved, or no longer. */
  pin(): void {
    const { joint, joints, pins } = this.app.session.value;
    const chosen = [...new Set([...joints, joint])];
    const isPinned = chosen.every((one) => pins.includes(one));
    const others = pins.filter((one) => !chosen.includes(one));
    this.app.session.update({ pins: isPinned ? others : [...others, ...chosen] });
    this.update();
  }

  /** The pose that is selected, where the playhead is at it: its joints are dragged then, and no targets are made. */
  private edited(): Pose | null {
    const { selection, person, time } = this.app.session.value;
    const pose = this.isOn() && selection.kind === "pose" && poseNear(this.app.project.value, person, time);
    return pose && pose.id === selection.id ? pose : null;
  }

  /** Move the joint's target by metres, from the keyboard. */
  nudge(x: number, y: number, z: number): void {
    const { x: px, y: py, z: pz } = this.proxy.position;
    this.proxy.position.set(px + x, Math.max(py + y, 0), pz + z);
    this.dragging = `nudge:${this.app.session.value.joint}`;
    this.taken = this.edited()?.positions ?? [];
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
      this.taken = this.edited()?.positions ?? [];
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
    const own = this.edited();
    if (own) return this.move(own, position, draft);
    const at = toFrame(time);
    const id = newId();
    this.app.project.change("ask for a joint", (old) => setTarget(old, person, joint, at, position, id), {
      merge: this.dragging,
      draft,
    });
    const target = targetAt(this.app.project.value, person, joint, at);
    if (target) this.app.session.update({ selection: { kind: "target", id: target.id } });
    this.preview(position);
  }

  /** Move the chosen joints of a pose by the way that the proxy went. */
  private move(pose: Pose, to: Vec3, draft: boolean): void {
    const { joint, joints, person, pins } = this.app.session.value;
    const from = this.taken[joint]!;
    const way: Vec3 = [to[0] - from[0], to[1] - from[1], to[2] - from[2]];
    const positions = moved(this.taken, [...new Set([...joints, joint])], way, pins);
    this.app.project.change("change a pose", (old) => changePose(old, person, pose.id, { positions }), {
      merge: `${this.dragging}:${pose.id}`,
      draft,
    });
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
