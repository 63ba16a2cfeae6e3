/** The path on the floor: drawn freehand or by points, its points and facing handles dragged. */

import * as THREE from "three";
import { type App, shownClip } from "../app/app";
import { NOTHING } from "../app/session";
import { jointAt } from "../body/clip";
import { addPoint, changePoint, drawPath } from "../project/constraints";
import { type PathPoint, length, newId, round } from "../project/model";
import { type Ground, along, apart, curve, direction, placeAt, timed } from "../project/path";
import { Line } from "./lines";
import type { Scene } from "./scene";
import type { StageTheme } from "./theme";

const HEIGHT = 0.012;
/** Metres from a point to its facing handle, and pixels within which a handle is grabbed. */
const ARM = 0.42;
const GRAB = 16;
/** Pixels that the pointer moves before a click becomes a line. */
const DRAWN = 9;

type Drag =
  | { kind: "point" | "facing"; index: number; key: string; moved: boolean }
  | { kind: "new"; from: [number, number]; line: Ground[]; drawn: boolean };

export class PathTool {
  private readonly group = new THREE.Group();
  private readonly lines: readonly [Line, Line];
  private readonly arms = new THREE.Group();
  private readonly handles = new THREE.Group();
  private readonly runner: THREE.Mesh;
  private readonly cursor: THREE.Mesh;
  private drag: Drag | null = null;
  /** Where the keyboard would put the next point; null: nobody moved it. */
  private keyboard: Ground | null = null;

  constructor(
    private readonly app: App,
    private readonly scene: Scene,
    private theme: StageTheme,
  ) {
    this.lines = [new Line(theme.path[0], 3.5), new Line(theme.path[1], 3.5)];
    this.runner = disc(0.07, theme.path[0]);
    this.cursor = ring(0.12, theme.path[0]);
    this.cursor.visible = false;
    this.group.add(...this.lines.map((one) => one.object), this.arms, this.handles, this.runner, this.cursor);
    scene.scene.add(this.group);
    this.update();
  }

  look(theme: StageTheme): void {
    this.theme = theme;
    this.lines.forEach((line, index) => line.color(theme.path[index]!));
    this.update();
  }

  /** Bring the picture up to the project. */
  update(): void {
    const project = this.app.project.value;
    const { person, tool } = this.app.session.value;
    this.lines.forEach((line, index) => {
      const drawing = this.drag?.kind === "new" && this.drag.drawn && index === person ? this.drag.line : null;
      const points = drawing ?? curve(project.people[index]?.path?.points ?? []);
      line.through(points.map(({ x, z }) => [x, HEIGHT, z] as const));
    });
    this.drawHandles(project.people[person]?.path?.points ?? []);
    this.cursor.visible = tool === "path" && this.keyboard !== null;
    if (this.keyboard) this.cursor.position.set(this.keyboard.x, HEIGHT, this.keyboard.z);
    this.at(this.app.session.value.time);
    this.scene.invalidate();
  }

  /** Where the path's end and the chosen point's facing handle are on the screen, for scripts. */
  reportPositions(): void {
    const { selection, person } = this.app.session.value;
    const points = this.app.project.value.people[person]?.path?.points ?? [];
    const chosen = selection.kind === "point" && points[selection.index] ? selection.index : -1;
    this.scene.report("pathEnd", points.at(-1) ? this.onScreen(points.at(-1)!) : null);
    this.scene.report("facing", chosen >= 0 ? this.onScreen(tip(points, chosen)) : null);
  }

  /** Show where on the path the person should be. */
  at(time: number): void {
    const project = this.app.project.value;
    const path = project.people[this.app.session.value.person]?.path;
    const walked = path && timed(path, length(project));
    this.runner.visible = Boolean(walked);
    if (!walked) return;
    const { x, z } = placeAt(walked, time);
    this.runner.position.set(x, HEIGHT + 0.002, z);
  }

  /** True: the press belongs to the path. */
  press(event: PointerEvent): boolean {
    const grabbed = this.grabbed(event);
    if (grabbed) {
      this.drag = { ...grabbed, key: `path:${newId()}`, moved: false };
      this.app.session.update({ selection: { kind: "point", index: grabbed.index } });
      return true;
    }
    if (this.app.session.value.tool !== "path" || event.button !== 0) return false;
    const at = this.scene.floorAt(event.clientX, event.clientY);
    if (!at) return false;
    this.drag = { kind: "new", from: [event.clientX, event.clientY], line: [at], drawn: false };
    return true;
  }

  move(event: PointerEvent): void {
    const at = this.drag && this.scene.floorAt(event.clientX, event.clientY);
    if (!this.drag || !at) return;
    if (this.drag.kind === "new") {
      const [x, y] = this.drag.from;
      this.drag.drawn ||= Math.hypot(event.clientX - x, event.clientY - y) > DRAWN;
      if (apart(this.drag.line.at(-1)!, at) > 0.03) this.drag.line.push({ x: at.x, z: at.z });
      this.update();
      return;
    }
    this.drag.moved = true;
    this.shift(this.drag, at, event.altKey, true);
  }

  /** The gesture ends: what it made is drawn. */
  release(event: PointerEvent): void {
    const drag = this.drag;
    this.drag = null;
    if (!drag) return;
    const { project, session } = this.app;
    const who = session.value.person;
    if (drag.kind === "new") {
      if (drag.drawn) project.change("draw a path", (old) => drawPath(old, who, drag.line));
      else
        project.change("add a point", (old) => addPoint(old, who, snapped(drag.line[0]!, event.altKey), this.start()));
      const count = project.value.people[who]?.path?.points.length ?? 0;
      session.update({ selection: count ? { kind: "point", index: count - 1 } : NOTHING });
    } else if (drag.moved) {
      const at = this.scene.floorAt(event.clientX, event.clientY);
      if (at) this.shift(drag, at, event.altKey, false);
    }
    this.update();
  }

  /** The keyboard's cursor goes over the floor. */
  nudge(x: number, z: number): void {
    const last = this.app.project.value.people[this.app.session.value.person]?.path?.points.at(-1);
    const from = this.keyboard ?? last ?? this.start();
    this.keyboard = { x: round(from.x + x), z: round(from.z + z) };
    this.update();
  }

  /** A point where the keyboard's cursor is. */
  placePoint(): void {
    const at = this.keyboard;
    if (!at) return this.nudge(0, 0.5);
    const who = this.app.session.value.person;
    this.app.project.change("add a point", (old) => addPoint(old, who, at, this.start()));
    this.keyboard = null;
    this.update();
  }

  private shift(drag: Exclude<Drag, { kind: "new" }>, at: Ground, fine: boolean, draft: boolean): void {
    const who = this.app.session.value.person;
    const point = this.app.project.value.people[who]?.path?.points[drag.index];
    if (!point) return;
    const { x, z } = snapped(at, fine);
    const turned = Math.round(direction(point, at) / (fine ? 1 : 15)) * (fine ? 1 : 15);
    const part = drag.kind === "point" ? { x, z } : { facing: turned };
    const label = drag.kind === "point" ? "move a point" : "turn a facing";
    this.app.project.change(label, (old) => changePoint(old, who, drag.index, part), { merge: drag.key, draft });
  }

  private start(): Ground {
    const clip = shownClip(this.app);
    if (!clip) return { x: 0, z: 0 };
    const [x, , z] = jointAt(clip, this.app.session.value.person, 0, 0);
    return { x: round(x), z: round(z) };
  }

  private grabbed(event: PointerEvent): { kind: "point" | "facing"; index: number } | null {
    const points = this.app.project.value.people[this.app.session.value.person]?.path?.points ?? [];
    for (let index = points.length - 1; index >= 0; index -= 1) {
      const point = points[index]!;
      if (this.isNear(event, point)) return { kind: "point", index };
      if (this.hasArm(index) && this.isNear(event, tip(points, index))) return { kind: "facing", index };
    }
    return null;
  }

  private isNear(event: PointerEvent, place: Ground): boolean {
    const [x, y, depth] = this.onScreen(place);
    return depth < 1 && Math.hypot(event.clientX - x, event.clientY - y) < GRAB;
  }

  /** Pixels of the window, and the depth from -1 to 1. */
  private onScreen(place: Ground): [number, number, number] {
    return this.scene.onScreen(new THREE.Vector3(place.x, HEIGHT, place.z));
  }

  /** Only the chosen point and those with a facing of their own show a handle. */
  private hasArm(index: number): boolean {
    const { selection, person } = this.app.session.value;
    const point = this.app.project.value.people[person]?.path?.points[index];
    return point?.facing != null || (selection.kind === "point" && selection.index === index);
  }

  private drawHandles(points: readonly PathPoint[]): void {
    const { selection, person } = this.app.session.value;
    clear(this.handles);
    clear(this.arms);
    const color = this.theme.path[person]!;
    (this.runner.material as THREE.MeshBasicMaterial).color.set(color);
    points.forEach((point, index) => {
      const chosen = selection.kind === "point" && selection.index === index;
      const handle = disc(chosen ? 0.1 : 0.065, color);
      handle.position.set(point.x, HEIGHT + 0.001, point.z);
      this.handles.add(handle);
      if (point.stop > 0) {
        const stop = ring(0.14, color);
        stop.position.set(point.x, HEIGHT, point.z);
        this.handles.add(stop);
      }
      if (!this.hasArm(index)) return;
      const end = tip(points, index);
      const arm = new Line(color, 2, point.facing === null ? 0.45 : 1);
      arm.through([
        [point.x, HEIGHT, point.z],
        [end.x, HEIGHT, end.z],
      ]);
      const head = cone(color);
      head.position.set(end.x, HEIGHT, end.z);
      head.rotation.y = (facingOf(points, index) * Math.PI) / 180;
      this.arms.add(arm.object, head);
    });
  }
}

function facingOf(points: readonly PathPoint[], index: number): number {
  return points[index]!.facing ?? along(points, index);
}

function tip(points: readonly PathPoint[], index: number): Ground {
  const radians = (facingOf(points, index) * Math.PI) / 180;
  const { x, z } = points[index]!;
  return { x: x + Math.sin(radians) * ARM, z: z + Math.cos(radians) * ARM };
}

/** To the decimetre, unless the user wants it fine. */
function snapped(at: Ground, fine: boolean): Ground {
  const step = fine ? 100 : 10;
  return { x: Math.round(at.x * step) / step, z: Math.round(at.z * step) / step };
}

function flat(geometry: THREE.BufferGeometry, color: string): THREE.Mesh {
  return new THREE.Mesh(geometry.rotateX(-Math.PI / 2), new THREE.MeshBasicMaterial({ color, side: THREE.DoubleSide }));
}

function disc(radius: number, color: string): THREE.Mesh {
  return flat(new THREE.CircleGeometry(radius, 32), color);
}

export function ring(radius: number, color: string): THREE.Mesh {
  return flat(new THREE.RingGeometry(radius - 0.02, radius, 40), color);
}

function cone(color: string): THREE.Mesh {
  const shape = new THREE.Shape([new THREE.Vector2(-0.07, 0), new THREE.Vector2(0.07, 0), new THREE.Vector2(0, -0.14)]);
  return flat(new THREE.ShapeGeometry(shape).rotateZ(Math.PI), color).rotateY(Math.PI);
}

function clear(group: THREE.Group): void {
  group.traverse((one) => {
    if (one instanceof THREE.Mesh) one.geometry.dispose();
  });
  group.clear();
}
