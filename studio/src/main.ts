/** Puts the page together. */

import "./style/colors.css";
import "./style/base.css";
import "./style/buttons.css";
import "./style/dialogs.css";
import "./style/help.css";
import "./style/live.css";
import "./style/panels.css";
import "./style/timeline.css";
import "./style/narrow.css";
import { type Parts, actions, nudged } from "./app/actions";
import { type App, faultOf } from "./app/app";
import { Deeds } from "./app/deeds";
import { h } from "./app/dom";
import { Drawer } from "./app/drawing";
import { remember, remembered } from "./app/memory";
import { Files } from "./app/files";
import { Saver, restored } from "./app/saving";
import { TOUCH, keyOf } from "./app/keys";
import { Live, type LiveState } from "./app/live";
import { Projects } from "./app/projects";
import { newSession } from "./app/session";
import { Signal } from "./app/signal";
import type { MotionClip } from "./body/clip";
import { backdropDialog } from "./panels/backdrop";
import { stageBar, topBar, transport } from "./panels/bars";
import { filmDialog } from "./panels/film";
import { inspector } from "./panels/inspector";
import { jointDialog } from "./panels/joints";
import { livePanel } from "./panels/live";
import { drops, help, notices, takeNames } from "./panels/overlays";
import { palette } from "./panels/palette";
import { historyPictures, nameDialog, recentProjects } from "./panels/pictures";
import { splits } from "./panels/splits";
import { promptBar, startCard } from "./panels/start";
import { History } from "./project/history";
import { renamed } from "./project/model";
import { Stage } from "./stage/stage";
import { listen } from "./timeline/gestures";
import { TimelineView } from "./timeline/view";

const THEME = "motionloom-theme";

function part<T extends HTMLElement = HTMLElement>(id: string): T {
  return document.getElementById(id) as T;
}

function isDark(): boolean {
  return document.documentElement.dataset.theme === "dark";
}

function setTheme(name: string): void {
  document.documentElement.dataset.theme = name;
}

async function start(): Promise<void> {
  setTheme(localStorage.getItem(THEME) ?? (matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light"));
  const begin = await restored();
  const app: App = {
    project: new History(begin.project, await remembered(begin.stamp.id, begin.project), renamed),
    session: newSession(),
    denoising: new Signal<readonly MotionClip[]>([]),
    live: new Signal<LiveState | null>(null),
  };
  const stage = new Stage(app, part<HTMLCanvasElement>("canvas"), isDark());
  const drawer = new Drawer(app);
  const deeds = new Deeds(app, drawer);
  const live = new Live(app, drawer, deeds, stage.scene);
  stage.sentTo = (place) => live.go(place);
  const saver = new Saver(app, begin, () => {
    drawer.loadTakes();
    drawer.schedule();
  });
  remember(app.project, () => app.session.value.stamp.id);
  const projects = new Projects(app, saver, drawer);
  const files = new Files(app, deeds, projects);
  const timeline = new TimelineView(app, part("tracks"), {
    write: (id, text, second) => deeds.write(id, text, second),
    written: () => drawer.schedule(),
  });
  const parts: Parts = {
    app,
    drawer,
    deeds,
    files,
    projects,
    live,
    stage,
    choose: drops(files, document.body),
    editWords: (id) => timeline.edit(id),
    zoom: (factor) => timeline.zoom(factor),
    fit: () => timeline.fit(),
    toggleTheme: () => {
      setTheme(isDark() ? "light" : "dark");
      localStorage.setItem(THEME, isDark() ? "dark" : "light");
      stage.look(isDark());
      timeline.render();
    },
  };
  show(parts, timeline, saver);
  drawer.loadTakes();
  drawer.schedule();
  app.session.update({ playing: begin.isNew || app.project.value.takes.length > 0, welcome: begin.isNew });
  // Who comes back and types, writes: no letter acts before somebody has gone to work.
  if (!begin.isNew && !TOUCH) part("prompt").querySelector("input")!.focus({ preventScroll: true });
  document.body.dataset.ready = "true";
  performance.mark("ready");
}

/** The panels, each in its place of the page. */
function show(parts: Parts, timeline: TimelineView, saver: Saver): void {
  const { app, drawer, deeds, files, projects, live, stage } = parts;
  const all = actions(parts);
  topBar(app, all, part("top"));
  stageBar(app, all, part("tools"), part("views"));
  transport(app, all, part("transport"));
  inspector(app, all, deeds, part("inspector"));
  notices(
    app,
    () => drawer.schedule(),
    (choice) => void saver.settle(choice),
    part("notices"),
  );
  takeNames(app, part("names"));
  livePanel(app, live, part("live"));
  help(app, all);
  palette(app, all);
  historyPictures(app);
  recentProjects(app, projects);
  nameDialog(app, projects);
  jointDialog(app, files);
  filmDialog(app, stage);
  backdropDialog(app, stage.scene);
  startCard(app, projects, part("start"), (pixels) => stage.scene.showAbove(pixels));
  promptBar(app, projects, part("prompt"));
  splits();
  listen(app, timeline, part("tracks"));
  const busy = () => {
    const { drawing, pending } = app.session.value;
    part("stage").setAttribute("aria-busy", String(drawing !== null || pending));
    document.body.toggleAttribute("data-sheet", app.session.value.sheet);
  };
  app.session.subscribe(busy);
  busy();
  part("tracks").addEventListener("click", (event) => {
    const act = (event.target as Element).closest<HTMLElement>("[data-act]")?.dataset.act;
    if (act) all[act]!.run();
  });
  const byKey = new Map(Object.values(all).flatMap((action) => action.keys.map((key) => [key, action] as const)));
  addEventListener("keydown", (event) => {
    if (isTyping(event) || document.querySelector("dialog[open]")) return;
    if (live.press(event)) return event.preventDefault();
    if (live.isOn && !LIVE_TOO.some((name) => all[name]!.keys.includes(keyOf(event)))) return;
    if (numbered(event, parts)) return;
    const action = byKey.get(keyOf(event));
    const isButton = event.target instanceof HTMLElement && event.target.matches("button, summary");
    if (isButton && (event.key === "Enter" || event.key === " ")) return;
    if (nudged(event, parts)) return event.preventDefault();
    if (!action || isCopying(event)) return;
    event.preventDefault();
    action.run();
  });
  const broke = (error: unknown) => app.session.update({ error: { message: faultOf(error), at: null } });
  addEventListener("error", (event) => event.error && broke(event.error));
  addEventListener("unhandledrejection", (event) => broke(event.reason));
  addEventListener("keyup", (event) => live.release(event));
  addEventListener("blur", () => live.letGo());
}

/** What can be done in live mode besides steering. */
const LIVE_TOO = ["live", "follow", "above", "theme", "help"];

/** Keys that write nothing into an empty field, and take nothing out of it. */
const WRITES_NOTHING = /^( |Arrow\w+|Page\w+|Home|End|F1)$/;

/** Keys belong to the field that is written in, but for undo and whatever else goes with Ctrl and is no editing. */
function isTyping(event: KeyboardEvent): boolean {
  const { target } = event;
  if (!(target instanceof HTMLElement) || !target.matches("input, textarea, select")) return false;
  if (target.closest("[hidden], dialog:not([open])")) return false;
  if (target.closest("#prompt") && !(target as HTMLInputElement).value && WRITES_NOTHING.test(event.key)) return false;
  return !(event.ctrlKey || event.metaKey) || "acvx".includes(event.key.toLowerCase());
}

/** Words of the page that are marked are what Ctrl+C copies. */
function isCopying(event: KeyboardEvent): boolean {
  return keyOf(event) === "Ctrl+C" && getSelection()?.isCollapsed === false;
}

/** A number chooses a future or keeps a take. */
function numbered(event: KeyboardEvent, { app, deeds }: Parts): boolean {
  const index = Number(event.key) - 1;
  if (!/^[1-9]$/.test(event.key) || event.ctrlKey || event.altKey || event.metaKey) return false;
  const { fan, clips } = app.session.value;
  if (fan) deeds.chooseFuture(index);
  else if (clips.length > 1 && index < clips.length)
    app.project.change(`keep take ${index + 1}`, (old) => (old.kept === index ? old : { ...old, kept: index }));
  else return false;
  return true;
}

start().catch((error: Error) => {
  const why = /webgl/i.test(error.message)
    ? "this browser shows no 3D pictures (WebGL); turn on hardware acceleration, or use another browser."
    : faultOf(error);
  part("notices").replaceChildren(h("p", { class: "notice", role: "alert" }, `The page cannot start: ${why}`));
});
