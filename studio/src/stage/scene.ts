/** The scene with its light, renderer and cameras; draws a frame when somebody says that something changed. */

import * as THREE from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import { type Backdrop, NONE, cover, textureOf } from "./backdrop";
import { Floor } from "./floor";
import type { Vec3 } from "../project/model";
import { Pending } from "./pending";
import type { StageTheme } from "./theme";

/** The layer of what is there to be dragged, which no film shows. */
export const HANDLES = 1;

/** The part of the picture's height that people with raised hands take. */
const PEOPLE = 0.8;

/** Frames slower than this for a while make the picture coarser. */
const SLOW = 45;
const PATIENCE = 12;
const COARSEST = 0.5;
/** Of a coarse shadow map, so that what is round does not speckle itself. */
const COARSE_BIAS = 0.06;
/** Milliseconds without a new picture until a coarse one is drawn sharp. */
const REST = 250;
/** Where processors draw the pictures, as drivers call themselves. */
const SOFTWARE = /swiftshader|llvmpipe|softpipe|software|basic render/i;

export class Scene {
  readonly scene = new THREE.Scene();
  readonly camera = new THREE.PerspectiveCamera(38, 1, 0.05, 120);
  readonly renderer: THREE.WebGLRenderer;
  readonly orbit: OrbitControls;
  /** Whether processors draw the pictures, which then are not free for anything else. */
  readonly software: boolean;
  private readonly floor: Floor;
  private readonly sky: THREE.HemisphereLight;
  private readonly sun: THREE.DirectionalLight;
  private dirty = true;
  private slow = 0;
  private readonly fine = Math.min(devicePixelRatio, 2);
  private coarse = this.fine;
  private last = 0;
  /** When the last picture was drawn, and whether it has fewer pixels than it could have. */
  private drawn = 0;
  private isCoarse = false;
  private readonly pending: Pending;
  private next = 0;
  private covered = 0;
  private theme: StageTheme;
  private backdrop = NONE;
  private picture: THREE.Texture | null = null;
  /** The colour behind everything. */
  readonly color = new THREE.Color();
  private besides = 0;
  /** While pictures of a film are drawn: their size. */
  private filmed: readonly [number, number] | null = null;
  private readonly flat = document.createElement("canvas");
  private readonly sizes = new ResizeObserver(() => this.resize());

  /** True: processors are needed elsewhere; a picture that nobody waits for is drawn sharp a second later. */
  busy: () => boolean = () => false;
  /** Called for each frame with the milliseconds since the last one; true: draw. */
  step: (elapsed: number) => boolean = () => false;
  /** Called behind each picture. */
  painted: () => void = () => undefined;
  /** Called for each picture of a film: draws over it, which is so wide and high. */
  over: (pen: CanvasRenderingContext2D, width: number, height: number) => void = () => undefined;
  /** Called instead of a plain draw, where the picture is divided. */
  paint: (() => void) | null = null;

  constructor(
    readonly canvas: HTMLCanvasElement,
    theme: StageTheme,
  ) {
    this.theme = theme;
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: true, preserveDrawingBuffer: true });
    this.renderer.setPixelRatio(this.fine);
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.type = THREE.PCFShadowMap;
    this.renderer.toneMapping = THREE.NeutralToneMapping;
    this.floor = new Floor(theme);
    this.sky = new THREE.HemisphereLight(theme.sky, theme.ground, theme.fill);
    this.sun = sunlight();
    this.scene.add(this.floor.group, this.sky, this.sun, this.sun.target);
    this.camera.position.set(2.5, 1.65, 3.5);
    this.camera.layers.enable(HANDLES);
    this.orbit = new OrbitControls(this.camera, canvas);
    this.orbit.target.set(0, 0.86, 0);
    this.orbit.enableDamping = true;
    this.orbit.dampingFactor = 0.12;
    this.orbit.maxPolarAngle = Math.PI / 2 - 0.03;
    this.orbit.minDistance = 0.8;
    this.orbit.maxDistance = 40;
    this.orbit.addEventListener("change", () => this.invalidate());
    this.look(theme);
    this.software = isSoftware(this.renderer.getContext());
    this.pending = new Pending(this.renderer.getContext() as WebGL2RenderingContext);
    if (this.software) this.coarsen(COARSEST);
    this.sizes.observe(canvas.parentElement!);
    this.resize();
    this.next = requestAnimationFrame((now) => this.frame(now));
  }

  /** Draw no more, and give back what the graphics card holds. */
  dispose(): void {
    cancelAnimationFrame(this.next);
    this.sizes.disconnect();
    this.orbit.dispose();
    this.renderer.dispose();
    this.renderer.forceContextLoss();
  }

  /** Show the people above something that lies over so many pixels at the bottom, smaller if they need it. */
  showAbove(pixels: number): void {
    this.covered = pixels;
    this.resize();
  }

  /** Show the middle of the picture in the middle of what is left beside this part of its width at the right. */
  aside(part: number): void {
    if (part === this.besides) return;
    this.besides = part;
    this.resize();
  }

  invalidate(): void {
    this.dirty = true;
  }

  look(theme: StageTheme): void {
    this.theme = theme;
    this.color.set(this.backdrop.color ?? theme.background);
    this.scene.background = this.picture ?? this.color;
    this.renderer.setClearColor(this.color);
    this.scene.fog = this.picture ? null : new THREE.Fog(this.color, 14, 34);
    this.sky.color.set(theme.sky);
    this.sky.groundColor.set(theme.ground);
    this.sky.intensity = theme.fill;
    this.sun.intensity = theme.sun;
    this.floor.look(theme);
    this.invalidate();
  }

  /** Show a colour or a picture behind everything. */
  async behind(backdrop: Backdrop): Promise<void> {
    const picture = backdrop.picture === null ? null : await textureOf(backdrop.picture);
    this.picture?.dispose();
    [this.backdrop, this.picture] = [backdrop, picture];
    this.look(this.theme);
    this.resize();
  }

  /** Light and orbit go where the people are. */
  centre(x: number, z: number, follow: boolean, ease: number): void {
    this.sun.position.set(x + 2.4, 5.2, z + 2.2);
    this.sun.target.position.set(x, 0, z);
    this.floor.centre(x, z);
    if (!follow) return;
    const step = new THREE.Vector3(x - this.orbit.target.x, 0, z - this.orbit.target.z).multiplyScalar(ease);
    if (step.lengthSq() < 1e-10) return;
    this.orbit.target.add(step);
    this.camera.position.add(step);
  }

  /** Where the camera looks over the floor: radians from +Z towards +X. */
  yaw(): number {
    const { target } = this.orbit;
    return Math.atan2(target.x - this.camera.position.x, target.z - this.camera.position.z);
  }

  /** Turn the camera about what it looks at. */
  turn(radians: number): void {
    const arm = this.camera.position.clone().sub(this.orbit.target);
    this.camera.position.copy(this.orbit.target).add(arm.applyAxisAngle(new THREE.Vector3(0, 1, 0), radians));
    this.invalidate();
  }

  /** Where a place of the picture meets the floor; null: nowhere near. */
  floorAt(clientX: number, clientY: number, height = 0): THREE.Vector3 | null {
    const plane = new THREE.Plane(new THREE.Vector3(0, 1, 0), -height);
    const hit = this.ray(clientX, clientY).ray.intersectPlane(plane, new THREE.Vector3());
    return hit && hit.length() < 100 ? hit : null;
  }

  /** Pixels of the window, and the depth from -1 to 1. */
  onScreen(place: THREE.Vector3): [number, number, number] {
    const box = this.canvas.getBoundingClientRect();
    const at = place.clone().project(this.camera);
    return [box.left + ((at.x + 1) / 2) * box.width, box.top + ((1 - at.y) / 2) * box.height, at.z];
  }

  /** Say in the page where something is on the screen; null: it is not there. */
  report(name: string, at: readonly number[] | null): void {
    if (at) this.canvas.dataset[name] = at.map(Math.round).slice(0, 2).join();
    else delete this.canvas.dataset[name];
  }

  ray(clientX: number, clientY: number): THREE.Raycaster {
    const box = this.canvas.getBoundingClientRect();
    const at = new THREE.Vector2(
      ((clientX - box.left) / box.width) * 2 - 1,
      1 - ((clientY - box.top) / box.height) * 2,
    );
    const ray = new THREE.Raycaster();
    ray.setFromCamera(at, this.camera);
    return ray;
  }

  /** Draw the pictures of a film, of this size, and none for the page until it has ended (null). */
  film(size: readonly [number, number] | null): void {
    this.filmed = size;
    if (size) this.camera.layers.disable(HANDLES);
    else this.camera.layers.enable(HANDLES);
    this.renderer.setPixelRatio(size ? 1 : this.fine);
    this.resize();
  }

  /** The picture as it is now, with what is over it: beside the people as large as on the page, and never smaller. */
  shot(): Promise<Blob> {
    this.camera.lookAt(this.orbit.target);
    this.draw();
    const { width, height, clientHeight } = this.canvas;
    Object.assign(this.flat, { width, height });
    const pen = this.flat.getContext("2d")!;
    pen.drawImage(this.canvas, 0, 0);
    const scale = Math.max(height / clientHeight, 1);
    pen.scale(scale, scale);
    this.over(pen, width / scale, height / scale);
    return new Promise((done, fail) =>
      this.flat.toBlob(
        (blob) =>
          blob ? done(blob) : fail(new Error("this browser could not draw a picture of that size; choose another.")),
        "image/jpeg",
        0.95,
      ),
    );
  }

  /** Where feet are, under which the floor is darker. */
  stand(feet: readonly Vec3[]): void {
    this.floor.stand(feet);
  }

  private draw(): void {
    this.floor.face(this.yaw());
    if (this.paint) this.paint();
    else this.renderer.render(this.scene, this.camera);
  }

  private frame(now: number): void {
    this.next = requestAnimationFrame((next) => this.frame(next));
    if (this.filmed) return;
    const elapsed = Math.min(now - this.last, 250);
    this.last = now;
    const moved = this.step(elapsed);
    this.orbit.update();
    const changed = moved || this.dirty;
    if (!changed) this.slow = 0;
    const sharpens = this.isCoarse && now - this.drawn > (this.busy() ? 4 * REST : REST);
    if (!changed && !sharpens) return;
    this.dirty = changed;
    if (this.pending.isDrawing) return;
    this.dirty = false;
    // One change alone is drawn as it should be; several at once, and what changes while somebody draws, coarsely first.
    this.isCoarse = changed && this.coarse < this.fine && (now - this.drawn < REST || this.busy());
    this.sharpness(this.isCoarse ? this.coarse : this.fine);
    if (changed) this.drawn = now;
    this.draw();
    if (this.software) this.pending.begin();
    this.painted();
    if (changed) this.adapt(elapsed);
  }

  /** Without a GPU fewer pixels keep the motion in real time; what does not move is drawn sharp. */
  private adapt(elapsed: number): void {
    this.slow = elapsed > SLOW ? this.slow + 1 : 0;
    if (this.slow < PATIENCE) return;
    this.slow = 0;
    this.coarsen(Math.max(this.coarse * 0.75, COARSEST));
  }

  private coarsen(ratio: number): void {
    this.coarse = ratio;
    this.sun.shadow.mapSize.set(512, 512);
    this.sun.shadow.normalBias = COARSE_BIAS;
    this.sun.shadow.radius = 2.5;
    this.sun.shadow.map?.dispose();
    this.sun.shadow.map = null;
  }

  private sharpness(ratio: number): void {
    if (this.renderer.getPixelRatio() === ratio) return;
    this.renderer.setPixelRatio(ratio);
    this.resize();
    this.dirty = false;
  }

  private resize(): void {
    const { clientWidth, clientHeight } = this.canvas.parentElement!;
    const [width, height] = this.filmed ?? [clientWidth, clientHeight];
    if (!width || !height) return;
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    if (this.picture) cover(this.picture, width / height);
    const free = this.filmed ? height : height - Math.min(this.covered, height * 0.7);
    const size = Math.min(1, free / (PEOPLE * height));
    const [wide, high] = [width * size, height * size];
    const right = this.filmed ? 0 : (wide - width + this.besides * width) / 2;
    const up = (high - free) / 2;
    if (right || up || size < 1) this.camera.setViewOffset(wide, high, right, up, width, height);
    else this.camera.clearViewOffset();
    this.camera.updateProjectionMatrix();
    this.invalidate();
  }
}

function isSoftware(context: WebGLRenderingContext | WebGL2RenderingContext): boolean {
  const about = context.getExtension("WEBGL_debug_renderer_info");
  return about !== null && SOFTWARE.test(String(context.getParameter(about.UNMASKED_RENDERER_WEBGL)));
}

function sunlight(): THREE.DirectionalLight {
  const sun = new THREE.DirectionalLight("#fff6e8", 2);
  sun.castShadow = true;
  sun.shadow.mapSize.set(2048, 2048);
  sun.shadow.radius = 9;
  sun.shadow.bias = -0.0005;
  sun.shadow.normalBias = 0.02;
  const view = sun.shadow.camera;
  [view.left, view.right, view.top, view.bottom, view.near, view.far] = [-3.5, 3.5, 3.5, -3.5, 0.5, 14];
  return sun;
}
