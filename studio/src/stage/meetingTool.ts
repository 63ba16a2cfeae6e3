/** Where hands of two people meet: rings that are dragged, for both people at once. */

import * as THREE from "three";
import { type App, shownClip } from "../app/app";
import { type Meeting, meetings, middle, moveMeeting } from "../project/meetings";
import type { Vec3 } from "../project/model";
import { HANDLES, type Scene } from "./scene";
import type { StageTheme } from "./theme";

/** Pixels from a ring within which it is taken. */
const GRAB = 16;
/** Seconds from the playhead within which a meeting is of now. */
const NOW = 0.25;
const [HIGH, AROUND] = [0.2, 1.2];
const RING = new THREE.TorusGeometry(0.085, 0.009, 8, 40);

export class MeetingTool {
  private readonly group = new THREE.Group();
  private shown: readonly Meeting[] = [];
  private held: { meeting: Meeting; plane: THREE.Plane; to: Vec3 | null } | null = null;

  constructor(
    private readonly app: App,
    private readonly scene: Scene,
    private theme: StageTheme,
  ) {
    scene.scene.add(this.group);
  }

  look(theme: StageTheme): void {
    this.theme = theme;
    this.update();
  }

  /** Bring the rings up to the project, the motion and the playhead. */
  update(): void {
    const { sideBySide, fan, time } = this.app.session.value;
    const isOff = sideBySide || fan !== null || this.app.live.value !== null;
    this.shown = isOff ? [] : meetings(this.app.project.value, shownClip(this.app));
    while (this.group.children.length < this.shown.length)
      this.group.add(new THREE.Mesh(RING, new THREE.MeshBasicMaterial({ transparent: true, depthTest: false })));
    this.group.children.forEach((one, n) => {
      const meeting = this.shown[n];
      one.visible = meeting !== undefined;
      if (!meeting) return;
      const { material } = one as THREE.Mesh<THREE.BufferGeometry, THREE.MeshBasicMaterial>;
      material.color.set(meeting.ids ? this.theme.path[0] : this.theme.label);
      material.opacity = isNow(meeting, time) ? 1 : 0.35;
      one.renderOrder = 3;
      one.layers.set(HANDLES);
      one.position.set(...((this.held?.meeting === meeting && this.held.to) || middle(meeting)));
    });
    this.scene.canvas.dataset.meetings = String(this.shown.length);
  }

  /** Turn the rings to the camera, and say where the one of now is on the screen. */
  reportPositions(): void {
    for (const one of this.group.children) one.quaternion.copy(this.scene.camera.quaternion);
    const now = this.now();
    this.scene.report("meeting", now && this.scene.onScreen(new THREE.Vector3(...middle(now))));
  }

  /** Go to the next meeting behind the playhead, or the first one. */
  next(): void {
    const { time } = this.app.session.value;
    const next = this.shown.find((one) => one.time > time + 1e-3) ?? this.shown[0];
    if (next) this.app.session.update({ time: next.time, playing: false, tool: "meeting" });
  }

  /** Move the meeting of now by metres. */
  nudge(x: number, y: number, z: number): void {
    const now = this.now();
    if (!now) return;
    const [a, b, c] = middle(now);
    this.ask(now, [a + x, b + y, c + z], `meeting:${now.time}`);
  }

  /** Take the ring under the pointer; false: there is none. */
  press(event: PointerEvent): boolean {
    const isFree = ["select", "meeting"].includes(this.app.session.value.tool) && event.button === 0;
    const meeting = this.shown.find((one) => {
      const [x, y, depth] = this.scene.onScreen(new THREE.Vector3(...middle(one)));
      return depth < 1 && Math.hypot(x - event.clientX, y - event.clientY) < GRAB;
    });
    if (!isFree || !meeting) return false;
    const towards = this.scene.camera.getWorldDirection(new THREE.Vector3());
    const at = new THREE.Vector3(...middle(meeting));
    this.held = { meeting, plane: new THREE.Plane().setFromNormalAndCoplanarPoint(towards, at), to: null };
    const { time } = this.app.session.value;
    this.app.session.update({ playing: false, time: isNow(meeting, time) ? time : meeting.time });
    return true;
  }

  move(event: PointerEvent): void {
    const { held } = this;
    const at = held && this.scene.ray(event.clientX, event.clientY).ray.intersectPlane(held.plane, new THREE.Vector3());
    if (!held || !at) return;
    held.to = [at.x, Math.max(at.y, HIGH), at.z];
    this.update();
    this.scene.invalidate();
  }

  release(): void {
    const { held } = this;
    this.held = null;
    if (held?.to) this.ask(held.meeting, held.to);
    this.update();
  }

  /** Both people are asked to have their hands there, no farther from where they are than an arm is long. */
  private ask(meeting: Meeting, to: Vec3, merge?: string): void {
    const from = new THREE.Vector3(...middle(meeting));
    const way = new THREE.Vector3(...to).sub(from).clampLength(0, AROUND);
    const place = from.add(way).toArray();
    this.app.project.change("move a meeting of hands", (old) => moveMeeting(old, meeting, place, shownClip(this.app)), {
      merge,
      typed: merge !== undefined,
    });
  }

  private now(): Meeting | null {
    const { time } = this.app.session.value;
    return this.shown.find((one) => isNow(one, time)) ?? null;
  }
}

function isNow({ time, until }: Meeting, now: number): boolean {
  return now > time - NOW && now < (until ?? time) + NOW;
}
