/** The stage: who is on it at the playhead, the tools on it, and one picture or four side by side. */

import * as THREE from "three";
import { type App, denoised, duration, seenTakes, shownClip } from "../app/app";
import { jointAt } from "../body/clip";
import { HEAD, LEFT, RIGHT } from "../body/skeleton";
import type { Ground } from "../project/path";
import { GazeTool } from "./gazeTool";
import { Cast, type Ghost } from "./cast";
import { Character } from "./character";
import { FOLLOWING } from "./filming";
import { MeetingTool } from "./meetingTool";
import { PathTool, ring } from "./pathTool";
import { HeadLabels } from "./labels";
import { Scene } from "./scene";
import { Steps } from "./steps";
import { TargetTool } from "./targetTool";
import { DARK, GHOSTS, LIGHT, type StageTheme } from "./theme";
import { Trails } from "./trails";
import { SplitView } from "./views";

const FEET = [LEFT.ankle, RIGHT.ankle];
/** Pixels that the pointer may move in a click. */
const CLICKED = 5;
/** Seconds from the playhead at which the ghosts before and behind it are. */
const AROUND = [-0.6, -0.3, 0.3, 0.6];

export class Stage {
  private readonly gaze: GazeTool;
  readonly scene: Scene;
  readonly path: PathTool;
  readonly targets: TargetTool;
  readonly meetings: MeetingTool;
  private readonly cast: Cast;
  private readonly trails: Trails;
  private readonly character: Character;
  private readonly views: SplitView;
  private readonly steps: Steps;
  /** Where somebody is sent in live mode. */
  private readonly goal: THREE.Mesh;
  /** Called in live mode with the place on the floor that was clicked. */
  sentTo: (place: Ground) => void = () => undefined;

  constructor(
    private readonly app: App,
    canvas: HTMLCanvasElement,
    dark: boolean,
  ) {
    const theme = dark ? DARK : LIGHT;
    this.scene = new Scene(canvas, theme);
    this.cast = new Cast(this.scene.scene, theme);
    this.gaze = new GazeTool(app, this.scene, theme);
    this.trails = new Trails(this.scene.scene, theme);
    this.character = new Character(app, this.scene);
    this.views = new SplitView(this.scene);
    this.steps = new Steps(this.scene.scene, theme);
    this.path = new PathTool(app, this.scene, theme);
    this.targets = new TargetTool(app, this.scene, this.cast, theme);
    this.meetings = new MeetingTool(app, this.scene, theme);
    this.goal = ring(0.16, theme.path[0]);
    this.goal.visible = false;
    this.scene.scene.add(this.goal);
    this.scene.busy = () => app.session.value.drawing !== null || app.session.value.pending;
    this.scene.step = (elapsed) => this.step(elapsed);
    const said = new HeadLabels(app, this.scene);
    this.scene.painted = () => {
      this.gaze.reportPositions();
      this.path.reportPositions();
      this.targets.reportPositions();
      this.meetings.reportPositions();
      said.update();
      this.reportPerson();
    };
    this.listen(canvas);
    app.project.subscribe(() => this.update());
    app.session.subscribe((now, before) => this.changed(now, before));
    app.denoising.subscribe(() => this.place());
    app.live.subscribe((live) => {
      this.goal.visible = Boolean(live?.goal);
      if (live?.goal) this.goal.position.set(live.goal.x, 0.012, live.goal.z);
      this.steps.show(live ? null : shownClip(app));
      this.scene.invalidate();
    });
  }

  look(dark: boolean): void {
    const theme: StageTheme = dark ? DARK : LIGHT;
    this.scene.look(theme);
    this.cast.look(theme);
    this.gaze.look(theme);
    this.trails.look(theme);
    this.steps.look(theme);
    this.path.look(theme);
    this.targets.look(theme);
    this.meetings.look(theme);
    this.place();
  }

  /** Look from above, or from the side again. */
  fromAbove(): void {
    const { orbit, camera } = this.scene;
    const away = camera.position.clone().sub(orbit.target);
    const above = away.y > away.length() * 0.95;
    if (above) camera.position.copy(orbit.target).add(new THREE.Vector3(3.1, 1.1, 3.5));
    else camera.position.copy(orbit.target).add(new THREE.Vector3(0, Math.max(away.length(), 7), 0.02));
    this.scene.invalidate();
  }

  /** Show all of the motion, from where the camera looks. */
  frameAll(): void {
    const clip = shownClip(this.app);
    if (!clip) return;
    const box = new THREE.Box3();
    clip.people.forEach((_, person) => {
      for (let frame = 0; frame < clip.frames; frame += 1)
        box.expandByPoint(new THREE.Vector3(...jointAt(clip, person, 0, frame / clip.fps)));
    });
    const { orbit, camera } = this.scene;
    const ball = box.expandByScalar(1).getBoundingSphere(new THREE.Sphere());
    const half = (Math.min(camera.fov, camera.fov * camera.aspect) / 2) * (Math.PI / 180);
    const arm = camera.position
      .clone()
      .sub(orbit.target)
      .setLength(ball.radius / Math.sin(half));
    this.app.session.update({ follow: false });
    orbit.target.copy(ball.center);
    camera.position.copy(ball.center).add(arm);
    this.scene.invalidate();
  }

  /** The picture as it is. */
  picture(): Promise<Blob | null> {
    return new Promise((done) => this.scene.canvas.toBlob(done));
  }

  private changed(now: App["session"]["value"], before: App["session"]["value"]): void {
    if (now.tool !== before.tool) this.buttons();
    const kept = [
      "clips",
      "tool",
      "person",
      "joint",
      "joints",
      "selection",
      "ghosts",
      "around",
      "trails",
      "sideBySide",
      "views",
      "fan",
      "playing",
    ] as const;
    if (kept.some((key) => now[key] !== before[key])) this.update();
    else if (now.time !== before.time) this.place();
  }

  private update(): void {
    const { trails, sideBySide, fan } = this.app.session.value;
    this.trails.show(trails ? shownClip(this.app) : null);
    this.steps.show(sideBySide || fan || this.app.live.value ? null : shownClip(this.app));
    this.scene.canvas.dataset.steps = String(this.steps.count);
    this.path.update();
    this.character.update();
    this.place();
  }

  /** Everybody where they are at the playhead. */
  private place(): void {
    const { time, fan, sideBySide } = this.app.session.value;
    const views = sideBySide ? null : this.app.session.value.views;
    const drawn = denoised(this.app);
    const clip = drawn ?? shownClip(this.app);
    const isFuture = fan !== null && time > fan.past;
    // A character has the kept take's motion; what is being drawn is shown by the mannequin.
    const dressed = this.character.at(time, !sideBySide && !isFuture && drawn === null && !this.app.live.value);
    this.cast.show(clip, time, dressed || isFuture);
    this.cast.showGhosts(this.ghosts(), time);
    this.gaze.update();
    this.path.at(time);
    this.targets.update();
    this.meetings.update();
    this.views.show(views);
    const feet = (_: unknown, person: number) => FEET.map((joint) => jointAt(clip!, person, joint, time));
    this.scene.stand(sideBySide ? [] : (clip?.people.flatMap(feet) ?? []));
    const people = clip?.people.map((_, person) => jointAt(clip, person, 0, time)) ?? [[0, 1, 0] as const];
    this.scene.paint = sideBySide ? () => this.paintTakes() : views && (() => this.views.paint(views, people));
    this.scene.invalidate();
  }

  /** Say in the page where the first person's head and lower foot are on the screen. */
  private reportPerson(): void {
    const clip = shownClip(this.app);
    const place = (joint: number) => new THREE.Vector3(...jointAt(clip!, 0, joint, this.app.session.value.time));
    const onScreen = (joint: number) => this.scene.onScreen(place(joint));
    this.scene.report("head", clip && onScreen(HEAD));
    this.scene.report("foot", clip && FEET.map(onScreen).reduce((a, b) => (a[1] > b[1] ? a : b)));
  }

  private ghosts(): Ghost[] {
    const { fan, ghosts, around, time } = this.app.session.value;
    const clips = seenTakes(this.app);
    const shown = shownClip(this.app);
    const [, behind, before] = GHOSTS;
    const own: Ghost[] =
      around && shown && !fan && !this.app.live.value
        ? AROUND.map((apart) => ({ clip: shown, color: apart < 0 ? before : behind, apart }))
        : [];
    if (fan)
      return time <= fan.past ? [] : fan.clips.map((clip, index) => ({ clip, color: GHOSTS[index % GHOSTS.length]! }));
    if (!ghosts || clips.length < 2 || this.app.live.value) return own;
    const others = clips.flatMap((clip, index) =>
      index === this.app.project.value.kept ? [] : [{ clip, color: GHOSTS[index % GHOSTS.length]! }],
    );
    return [...own, ...others];
  }

  /** One frame of real time. */
  private step(elapsed: number): boolean {
    const { session } = this.app;
    const { playing, rate, time, repeat, follow } = session.value;
    const clip = denoised(this.app) ?? shownClip(this.app);
    if (playing) {
      const end = duration(this.app);
      const next = time + (elapsed / 1000) * rate;
      if (next <= end) session.update({ time: next });
      else session.update(repeat ? { time: end > 0 ? next % end : 0 } : { time: end, playing: false });
    }
    if (clip) {
      const [x, , z] = jointAt(clip, 0, 0, session.value.time);
      const before = this.scene.orbit.target.clone();
      this.scene.centre(
        x,
        z,
        follow && session.value.tool !== "path" && !this.targets.busy,
        1 - Math.exp(-elapsed / FOLLOWING),
      );
      if (before.distanceToSquared(this.scene.orbit.target) > 1e-7) return true;
    }
    return playing;
  }

  /** Every take in a part of the picture of its own. */
  private paintTakes(): void {
    const { time } = this.app.session.value;
    const clips = seenTakes(this.app);
    const { renderer, scene, camera } = this.scene;
    const size = renderer.getSize(new THREE.Vector2());
    const columns = clips.length > 1 ? 2 : 1;
    const rows = Math.ceil(clips.length / columns);
    const [width, height] = [size.x / columns, size.y / rows];
    renderer.clear();
    renderer.setScissorTest(true);
    this.cast.showGhosts([], time);
    clips.forEach((clip, index) => {
      const [x, y] = [(index % columns) * width, size.y - height * (Math.floor(index / columns) + 1)];
      this.cast.show(clip, time);
      renderer.setViewport(x, y, width, height);
      renderer.setScissor(x, y, width - 1, height - 1);
      camera.aspect = width / height;
      camera.updateProjectionMatrix();
      renderer.render(scene, camera);
    });
    camera.aspect = size.x / size.y;
    camera.updateProjectionMatrix();
    renderer.setScissorTest(false);
    renderer.setViewport(0, 0, size.x, size.y);
  }

  /** While a path is drawn the left button draws and the right one turns the picture. */
  private buttons(): void {
    const drawing = this.app.session.value.tool === "path";
    this.scene.orbit.mouseButtons = drawing
      ? { LEFT: null, MIDDLE: THREE.MOUSE.DOLLY, RIGHT: THREE.MOUSE.ROTATE }
      : { LEFT: THREE.MOUSE.ROTATE, MIDDLE: THREE.MOUSE.DOLLY, RIGHT: THREE.MOUSE.PAN };
    this.scene.canvas.style.cursor = drawing ? "crosshair" : "";
  }

  private listen(canvas: HTMLCanvasElement): void {
    let held = false;
    let holder: PathTool | MeetingTool = this.path;
    let pressed: [number, number] = [0, 0];
    // In the capture phase, before the orbit hears of it.
    canvas.addEventListener(
      "pointerdown",
      (event) => {
        pressed = [event.clientX, event.clientY];
        if (this.app.live.value) return;
        if (this.app.session.value.sideBySide) return this.keepUnder(event);
        holder = this.meetings.press(event) ? this.meetings : this.path;
        held = holder === this.meetings || this.path.press(event);
        if (held) {
          this.scene.orbit.enabled = false;
          canvas.setPointerCapture(event.pointerId);
        } else this.targets.press(event);
      },
      true,
    );
    canvas.addEventListener("pointermove", (event) => held && holder.move(event));
    const end = (event: PointerEvent) => {
      if (!held) return;
      held = false;
      this.scene.orbit.enabled = true;
      holder.release(event);
    };
    canvas.addEventListener("pointerup", end);
    canvas.addEventListener("pointercancel", end);
    canvas.addEventListener("click", (event) => {
      const isStill = Math.hypot(event.clientX - pressed[0], event.clientY - pressed[1]) < CLICKED;
      const place = this.app.live.value && isStill ? this.scene.floorAt(event.clientX, event.clientY) : null;
      if (place) this.sentTo({ x: place.x, z: place.z });
    });
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  }

  /** A click on one of several pictures keeps that take. */
  private keepUnder(event: PointerEvent): void {
    const clips = seenTakes(this.app);
    const box = (event.target as Element).getBoundingClientRect();
    const columns = clips.length > 1 ? 2 : 1;
    const rows = Math.ceil(clips.length / columns);
    const column = Math.floor(((event.clientX - box.left) / box.width) * columns);
    const index = Math.floor(((event.clientY - box.top) / box.height) * rows) * columns + column;
    if (index < this.app.session.value.clips.length)
      this.app.project.change(`keep take ${index + 1}`, (old) => ({ ...old, kept: index }));
  }
}
