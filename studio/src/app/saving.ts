/**
 * The project is saved on its own, on the server and in this browser, and found again after a crash of either.
 *
 * The server says which project it has and counts its states. What was changed here goes out with the state that it was
 * made from; where the server has another one by then, this page takes it over if nobody has changed anything here
 * (drawing alone is no change), and else asks. What this browser keeps, it keeps by the project's id.
 */

import { ProjectError, checked, filed, stampOf } from "../project/file";
import { type Project, type Stamp, exampleProject, newId } from "../project/model";
import type { Problem } from "../project/places";
import type { StoredHistory as KeptHistory } from "../project/history";
import { isUp, openProject, putAside, saveProject, savedProject, savedStamp } from "../server/api";
import { CLIENT, Refused, Unreachable } from "../server/http";
import { type App, fail } from "./app";
import { saveFile } from "./files";
import { EMPTY, remembered } from "./memory";
import { type Conflict, NOTHING } from "./session";

const KEY = "motionloom-studio";
const QUIET = 500;
const RETRY = 1000;
/** Milliseconds until a save is tried again for which there was no room. */
const ROOM = 5000;
/** Milliseconds between two looks at what others have saved; other tabs of this browser say it at once. */
const LOOK = 3000;
const PATIENCE = 5;
const UNREADABLE = 422;
const STALE = 409;

/** What the page begins with. */
export interface Start {
  readonly project: Project;
  readonly stamp: Stamp;
  readonly isNew: boolean;
  /** There is something in it that no server has; `edited`: that somebody did. */
  readonly pending: boolean;
  readonly edited: boolean;
  readonly conflict: Conflict | null;
  readonly told: string | null;
  readonly connected: boolean;
}

/** What this browser keeps of a project. */
interface EarlySave {
  readonly project: Project;
  readonly stamp: Stamp;
  readonly pending: boolean;
  readonly edited: boolean;
  /** The page that kept it, as the server knows it. */
  readonly client: string;
}

const PLAIN = { isNew: false, pending: false, edited: false, conflict: null, told: null, connected: true };

/** The project of last time: the server's, with what this browser has of the same project and the server never got. */
export async function restored(): Promise<Start> {
  let found: unknown;
  try {
    found = await savedProject();
  } catch (error) {
    if (error instanceof Refused && error.status === UNREADABLE)
      return setAside("The project in the folder cannot be read: it is not JSON.");
    const last = error instanceof Unreachable ? earlySave(localStorage.getItem(`${KEY}:last`)) : null;
    return last ? { ...PLAIN, ...last, connected: false } : freshStart();
  }
  const early = keptByEarlier();
  if (found === null) return unsaved(early) ?? freshStart();
  try {
    const project = checked(found);
    const stamp = stampOf(found) ?? { id: newId(), revision: 0 };
    return withEarlySave(project, stamp, found as Record<string, unknown>, early);
  } catch (error) {
    if (error instanceof ProjectError) return setAside(error.message);
    throw error;
  }
}

function freshStart(told: string | null = null): Start {
  return { ...PLAIN, project: exampleProject(), stamp: { id: newId(), revision: 0 }, isNew: true, told };
}

/** A project that this page cannot read stays on the server under another name. */
async function setAside(why: string): Promise<Start> {
  try {
    const name = await putAside();
    return freshStart(`${why} It stays in the project folder as ${name}, and this is a new one.`);
  } catch (error) {
    return freshStart(`${why} ${(error as Error).message}`);
  }
}

/** Changes that no server ever had may be another folder's: somebody says where they belong. */
function unsaved(early: EarlySave | null): Start | null {
  const here = early ?? earlySave(localStorage.getItem(`${KEY}:last`));
  if (!here?.pending || !here.edited || here.stamp.revision > 0) return null;
  return { ...PLAIN, ...here, conflict: { stamp: null, project: null } };
}

function withEarlySave(project: Project, stamp: Stamp, found: Record<string, unknown>, early: EarlySave | null): Start {
  const here = early ?? earlySave(stamp.id);
  if (!here?.pending || same(here.project, project)) return { ...PLAIN, project, stamp };
  const { by, from } = (found.written ?? {}) as { by?: unknown; from?: unknown };
  const isOwn = by === here.client && here.stamp.revision >= Number(from);
  if (here.stamp.id === stamp.id && (here.stamp.revision === stamp.revision || isOwn))
    return { ...PLAIN, ...here, stamp };
  if (!here.edited) return { ...PLAIN, project, stamp };
  return { ...PLAIN, ...here, conflict: { stamp, project } };
}

function same(one: Project, other: Project): boolean {
  return JSON.stringify(one) === JSON.stringify(other);
}

function earlySave(id: string | null): EarlySave | null {
  try {
    const found = JSON.parse(localStorage.getItem(`${KEY}:${id}`) ?? "null") as EarlySave | null;
    const stamp = stampOf(found?.project);
    return found && stamp && { ...found, project: checked(found.project), stamp };
  } catch {
    return null;
  }
}

/** What a page kept that knew no ids: of which project that was, nobody knows. */
function keptByEarlier(): EarlySave | null {
  try {
    const found = JSON.parse(localStorage.getItem(KEY) ?? "null") as { project: unknown; pending: boolean } | null;
    localStorage.removeItem(KEY);
    if (!found?.pending) return null;
    return {
      project: checked(found.project),
      stamp: { id: newId(), revision: 0 },
      pending: true,
      edited: true,
      client: "",
    };
  } catch {
    return null;
  }
}

export class Saver {
  private timer = 0;
  private retry = 0;
  /** What is being saved. */
  private sent: Project | null = null;
  /** What kept the last save from coming through. */
  private problem: Problem | null = null;
  private again = false;
  /** Looks until this page draws itself what another one wrote and has not drawn; 0: it waits for nobody. */
  private patience = 0;
  /** Somebody has done something here that the server has not got. */
  private edited: boolean;
  private readonly others = new BroadcastChannel(KEY);

  /** `back` is called when a server that was away answers again. */
  constructor(
    private readonly app: App,
    start: Start,
    private readonly back: () => void,
  ) {
    this.edited = start.edited;
    this.forgetOthers(start.stamp.id);
    app.session.update({ stamp: start.stamp, conflict: start.conflict, told: start.told });
    app.project.subscribe((_, change) => {
      if (change.label) this.edited = true;
      if (change.draft || change.elsewhere) return;
      this.keepHere(true);
      this.soon();
    });
    // A tab that is left or closed waits for nothing.
    addEventListener("pagehide", () => {
      const { saved, stamp, conflict } = this.app.session.value;
      if (saved !== "saving" || conflict) return;
      if (!this.sent) void this.save();
      else if (this.sent !== this.app.project.value) {
        void saveProject(this.app.project.value, stamp).catch(() => undefined); // the server knows whose the one before is
      }
    });
    app.session.subscribe((now, before) => {
      if (before.connected && !now.connected) this.wait();
    });
    this.others.onmessage = () => void this.look();
    document.addEventListener("visibilitychange", () => void this.look());
    setInterval(() => void this.look(), LOOK);
    if (start.pending) {
      this.keepHere(true);
      this.soon();
    }
    if (!start.connected) app.session.update({ connected: false });
  }

  /** `over`: what may be replaced although this was not made from it. */
  async save(over: Stamp | null = null): Promise<void> {
    clearTimeout(this.timer);
    if (this.app.session.value.conflict && !over) return;
    if (this.sent) return void (this.again = true);
    const saving = (this.sent = this.app.project.value);
    const edited = this.edited;
    this.edited = false;
    try {
      const stamp = await saveProject(saving, this.app.session.value.stamp, over);
      const { error } = this.app.session.value;
      this.app.session.update({ stamp, conflict: null, error: error === this.problem ? null : error });
      this.problem = null;
      this.others.postMessage(stamp.revision);
      if (saving === this.app.project.value) {
        this.keepHere(false);
        this.app.session.update({ saved: "saved" });
      }
    } catch (error) {
      this.edited ||= edited;
      await this.failed(error);
    } finally {
      this.sent = null;
      if (this.again) this.soon();
      this.again = false;
    }
  }

  /** Everything that was done here is on the server; raises an error with a sentence where it is not. */
  async flush(): Promise<void> {
    if (this.app.session.value.conflict) throw new Error("your changes are not saved; answer the question first.");
    while (this.sent) await new Promise((resume) => setTimeout(resume, 50));
    if (this.app.session.value.saved !== "saved") await this.save();
    if (this.app.session.value.saved !== "saved") throw new Error("this project cannot be saved, so it stays open.");
  }

  /** Begin another project in the folder; the one that was open stays there. */
  async begin(project: Project): Promise<void> {
    await this.flush();
    const stamp = await saveProject(project, { id: newId(), revision: 0 }, this.app.session.value.stamp);
    this.show(project, stamp, EMPTY);
  }

  /** Open another project of the folder, with its own history. */
  async open(id: string): Promise<void> {
    await this.flush();
    await openProject(id);
    const found = await savedProject();
    const [project, stamp] = [checked(found), stampOf(found)!];
    this.show(project, stamp, await remembered(stamp.id, project));
  }

  private show(project: Project, stamp: Stamp, kept: KeptHistory<Project>): void {
    this.edited = false;
    const cleared = {
      time: 0,
      selection: NOTHING,
      fan: null,
      range: null,
      clips: [],
      error: null,
      told: null,
    } as const;
    this.app.session.update({ stamp, conflict: null, saved: "saved", sideBySide: false, person: 0, ...cleared });
    this.app.project.begin(project, kept);
    this.keepHere(false);
    this.others.postMessage(stamp.revision);
  }

  /** What somebody chose where the server has something else: a file of what is here, what is there, or what is here. */
  async settle(choice: "copy" | "theirs" | "mine"): Promise<void> {
    const { conflict, stamp } = this.app.session.value;
    if (!conflict) return;
    if (choice === "mine") {
      if (conflict.stamp) return this.save(conflict.stamp);
      this.app.session.update({ conflict: null });
      return this.save();
    }
    if (choice === "copy") saveFile(this.app.project.value, stamp, "_mine");
    this.keepHere(false);
    if (conflict.stamp && !conflict.project) return location.reload();
    this.follow(conflict.project ?? exampleProject(), conflict.stamp ?? { id: newId(), revision: 0 });
    this.back();
  }

  private soon(): void {
    clearTimeout(this.timer);
    if (this.app.session.value.conflict) return;
    this.app.session.update({ saved: "saving" });
    this.timer = window.setTimeout(() => void this.save(), QUIET);
  }

  private later(): void {
    clearTimeout(this.timer);
    this.timer = window.setTimeout(() => void this.save(), ROOM);
  }

  private async failed(error: unknown): Promise<void> {
    try {
      if (error instanceof Refused && error.status === STALE) return await this.meet();
    } catch (other) {
      error = other;
    }
    this.app.session.update({ saved: "here" });
    fail(this.app, error);
    this.problem = this.app.session.value.error;
    if (error instanceof Refused && error.status >= 500) this.later();
  }

  /** Look whether somebody else has saved something. */
  private async look(): Promise<void> {
    const { conflict, connected } = this.app.session.value;
    if (this.sent || conflict || !connected || document.hidden) return;
    try {
      const stamp = await savedStamp();
      const own = this.app.session.value.stamp;
      if (this.sent || !stamp) return;
      if (stamp.id === own.id && stamp.revision === own.revision) {
        // Whoever wrote draws; if that page was closed meanwhile, this one does.
        if (this.patience && !--this.patience) this.back();
        return;
      }
      if (this.edited || this.app.session.value.saved !== "saved") await this.save();
      else await this.meet();
    } catch (error) {
      if (error instanceof Unreachable) this.app.session.update({ connected: false });
    }
  }

  /** The server has something else: it is taken over, or somebody is asked who has changed something here. */
  private async meet(): Promise<void> {
    const found = await savedProject();
    const stamp = stampOf(found);
    let project: Project | null = null;
    try {
      project = found === null ? null : checked(found);
    } catch {
      /* of another version, or nothing that this page knows */
    }
    if (project && stamp && !this.edited) return this.follow(project, stamp);
    this.app.session.update({ conflict: { stamp, project }, saved: "here" });
  }

  private follow(project: Project, stamp: Stamp): void {
    clearTimeout(this.timer);
    this.edited = false;
    this.app.session.update({ stamp, conflict: null, fan: null, saved: "saved" });
    if (!same(project, this.app.project.value)) this.app.project.follow(project, "what another page did");
    this.keepHere(false);
    this.patience = PATIENCE;
  }

  private keepHere(pending: boolean): void {
    const { stamp } = this.app.session.value;
    const project = filed(this.app.project.value, stamp);
    try {
      const value = JSON.stringify({ project, pending, edited: pending && this.edited, client: CLIENT });
      localStorage.setItem(`${KEY}:${stamp.id}`, value);
      localStorage.setItem(`${KEY}:last`, stamp.id);
    } catch {
      /* the browser keeps nothing; the server does */
    }
  }

  /** Other projects, of other folders, stay here only as far as no server has them. */
  private forgetOthers(id: string): void {
    const names = Array.from({ length: localStorage.length }, (_, index) => localStorage.key(index)!);
    for (const name of names.filter((one) => one.startsWith(`${KEY}:`))) {
      const other = name.slice(KEY.length + 1);
      if (other !== "last" && other !== id && !earlySave(other)?.pending) localStorage.removeItem(name);
    }
  }

  private wait(): void {
    clearTimeout(this.retry);
    this.retry = window.setTimeout(async () => {
      if (!(await isUp())) return this.wait();
      this.app.session.update({ connected: true });
      if (this.app.session.value.saved === "saved") await this.look();
      else await this.save();
      this.back();
    }, RETRY);
  }
}
