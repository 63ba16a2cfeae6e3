/** A path on the floor: one line of the pointer, or points set by the keyboard, for the motion to follow. */

import * as THREE from "three";
import { type Place, even } from "../prior/path";
import { simplified } from "../project/path";
import { Line } from "../stage/lines";
import type { Scene } from "../stage/scene";
import type { StageTheme } from "../stage/theme";
import { FARTHEST, MOST_POINTS } from "./link";

const HEIGHT = 0.012;
/** Metres between points of a line, and that an arrow key goes. */
const [STEP, STRIDE] = [0.03, 0.25];
/** Where the curve through points is shown. */
const SHARES = Array.from({ length: 121 }, (_, n) => n / 120);
/** Metres: a shorter line is a slip of the hand. */
const SHORTEST = 0.3;

export class FloorPath {
  private readonly line: Line;
  private readonly marks: THREE.Mesh[];
  private points: readonly Place[] = [];
  private drawn: { x: number; z: number }[] | null = null;
  private typed: Place[] = [];
  private cursor: Place = [0, 0];
  /** Where the camera was, and looked at, before a path is drawn. */
  private view: readonly [THREE.Vector3, THREE.Vector3] | null = null;

  /** `done`: a path is finished, or null, given up. */
  constructor(
    private readonly scene: Scene,
    theme: StageTheme,
    private readonly done: (points: readonly Place[] | null) => void,
  ) {
    this.line = new Line(theme.path[0], 3.5);
    this.marks = [new THREE.CircleGeometry(0.07, 32), new THREE.RingGeometry(0.1, 0.13, 32)].map((shape) => {
      const mark = new THREE.Mesh(shape.rotateX(-Math.PI / 2), new THREE.MeshBasicMaterial({ color: theme.path[0] }));
      mark.visible = false;
      return mark;
    });
    scene.scene.add(this.line.object, ...this.marks);
    const { canvas } = scene;
    canvas.addEventListener("pointerdown", (event) => this.press(event));
    canvas.addEventListener("pointermove", (event) => this.move(event));
    canvas.addEventListener("pointerup", () => this.release());
    canvas.addEventListener("pointercancel", () => this.stop(null));
    canvas.addEventListener("keydown", (event) => this.key(event));
  }

  /** Whether a path is being drawn. */
  get active(): boolean {
    return this.view !== null;
  }

  show(points: readonly Place[]): void {
    this.points = points;
    this.update();
  }

  look(theme: StageTheme): void {
    this.line.color(theme.path[0]);
    for (const mark of this.marks) (mark.material as THREE.MeshBasicMaterial).color.set(theme.path[0]);
    this.update();
  }

  /** Look down at the floor around its middle, and wait for a line. */
  start(): void {
    const { camera, orbit, canvas } = this.scene;
    if (this.active) return;
    this.view = [camera.position.clone(), orbit.target.clone()];
    orbit.target.set(0, orbit.target.y, 1);
    camera.position.set(0, 7.5, -4);
    orbit.enabled = false;
    [this.typed, this.cursor] = [[], [0, 0]];
    canvas.style.touchAction = "none";
    canvas.style.cursor = "crosshair";
    canvas.focus();
    this.update();
  }

  /** Back to the view of before; null: as it was. */
  stop(points: readonly Place[] | null): void {
    if (!this.view) return;
    this.scene.camera.position.copy(this.view[0]);
    this.scene.orbit.target.copy(this.view[1]);
    this.scene.orbit.enabled = true;
    this.scene.canvas.style.cursor = "";
    [this.view, this.drawn, this.typed] = [null, null, []];
    this.update();
    this.done(points);
  }

  private press(event: PointerEvent): void {
    const at = this.active && event.button === 0 ? this.scene.floorAt(event.clientX, event.clientY) : null;
    if (!at) return;
    this.scene.canvas.setPointerCapture(event.pointerId);
    this.drawn = [{ x: at.x, z: at.z }];
  }

  private move(event: PointerEvent): void {
    const at = this.drawn && this.scene.floorAt(event.clientX, event.clientY);
    if (!this.drawn || !at || Math.max(Math.abs(at.x), Math.abs(at.z)) > FARTHEST) return;
    const last = this.drawn.at(-1)!;
    if (Math.hypot(at.x - last.x, at.z - last.z) > STEP) this.drawn.push({ x: at.x, z: at.z });
    this.update();
  }

  private release(): void {
    const { drawn } = this;
    if (!drawn) return;
    this.drawn = null;
    const [first, last] = [drawn[0]!, drawn.at(-1)!];
    const length = drawn.slice(1).reduce((sum, at, n) => sum + Math.hypot(at.x - drawn[n]!.x, at.z - drawn[n]!.z), 0);
    if (length < SHORTEST) return this.update();
    const closed = Math.hypot(first.x - last.x, first.z - last.z) < 0.1;
    // A ring has no direction from its first to its last point: its two halves are simplified.
    const half = Math.floor(drawn.length / 2);
    let tolerance = 0.05;
    let kept = drawn;
    do {
      kept = closed
        ? [...simplified(drawn.slice(0, half + 1), tolerance), ...simplified(drawn.slice(half), tolerance).slice(1)]
        : simplified(drawn, tolerance);
      tolerance *= 1.5;
    } while (kept.length > MOST_POINTS);
    this.stop(kept.map(({ x, z }): Place => [rounded(x), rounded(z)]));
  }

  private key(event: KeyboardEvent): void {
    if (!this.active) return;
    const ways: Record<string, Place> = {
      ArrowUp: [0, STRIDE],
      ArrowDown: [0, -STRIDE],
      ArrowLeft: [STRIDE, 0],
      ArrowRight: [-STRIDE, 0],
    };
    const way = ways[event.key];
    const last = this.typed.at(-1);
    if (way) this.cursor = [this.cursor[0] + way[0], this.cursor[1] + way[1]];
    else if (event.key === "Enter") {
      if (last && last[0] === this.cursor[0] && last[1] === this.cursor[1]) {
        if (this.typed.length > 1) this.stop(this.typed);
      } else if (this.typed.length < MOST_POINTS) this.typed.push(this.cursor);
    } else if (event.key === "Escape") this.stop(null);
    else return;
    event.preventDefault();
    event.stopPropagation();
    this.update();
  }

  private update(): void {
    const set = this.active ? this.typed : this.points;
    const points = this.drawn?.map(({ x, z }): Place => [x, z]) ?? (set.length > 1 ? even(set, SHARES) : set);
    this.line.through(points.map(([x, z]) => [x, HEIGHT, z] as const));
    const [begin, cursor] = this.marks as [THREE.Mesh, THREE.Mesh];
    begin.visible = points.length > 0;
    if (points[0]) begin.position.set(points[0][0], HEIGHT, points[0][1]);
    cursor.visible = this.active && !this.drawn;
    cursor.position.set(this.cursor[0], HEIGHT, this.cursor[1]);
    this.scene.invalidate();
  }
}

const rounded = (x: number): number => Math.round(x * 100) / 100;
