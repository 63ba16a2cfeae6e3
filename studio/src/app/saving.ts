/** The project is saved on its own, on the server and in this browser, and found again after a crash of either. */

import { type Project, exampleProject } from "../project/model";
import { checked, written } from "../project/file";
import { isUp, saveProject, savedProject } from "../server/api";
import { isAway } from "../server/jobs";
import { type App, problemOf } from "./app";

const KEY = "motionloom-studio";
const QUIET = 500;
const RETRY = 1000;

/** The project of last time: the server's, unless this browser has a later one that the server never got. */
export async function restored(): Promise<{ project: Project; isNew: boolean }> {
  const here = stored();
  if (here?.pending) return { project: here.project, isNew: false };
  try {
    const found = await savedProject();
    if (found && typeof found === "object" && "segments" in found) return { project: checked(found), isNew: false };
  } catch {
    if (here) return { project: here.project, isNew: false };
  }
  return { project: exampleProject(), isNew: true };
}

function stored(): { project: Project; pending: boolean } | null {
  try {
    const found = JSON.parse(localStorage.getItem(KEY) ?? "null") as { project: unknown; pending: boolean } | null;
    return found && { project: checked(found.project), pending: found.pending };
  } catch {
    return null;
  }
}

export class Saver {
  private timer = 0;
  private retry = 0;

  /** `back` is called when a server that was away answers again. */
  constructor(
    private readonly app: App,
    private readonly back: () => void,
  ) {
    app.project.subscribe((_, change) => {
      if (change.draft) return;
      this.keepHere(true);
      clearTimeout(this.timer);
      this.app.session.update({ saved: "saving" });
      this.timer = window.setTimeout(() => void this.save(), QUIET);
    });
    // A tab that is left or closed waits for nothing.
    addEventListener("pagehide", () => {
      if (this.app.session.value.saved === "saving") void this.save();
    });
    app.session.subscribe((now, before) => {
      if (before.connected && !now.connected) this.wait();
    });
  }

  async save(): Promise<void> {
    clearTimeout(this.timer);
    const saving = this.app.project.value;
    try {
      await saveProject(saving);
      if (saving !== this.app.project.value) return;
      this.keepHere(false);
      this.app.session.update({ saved: "saved" });
    } catch (error) {
      this.app.session.update({
        saved: "here",
        ...(isAway(error) ? { connected: false } : { error: problemOf(this.app, error) }),
      });
    }
  }

  private keepHere(pending: boolean): void {
    try {
      localStorage.setItem(KEY, JSON.stringify({ project: JSON.parse(written(this.app.project.value)), pending }));
    } catch {
      /* the browser keeps nothing; the server does */
    }
  }

  private wait(): void {
    clearTimeout(this.retry);
    this.retry = window.setTimeout(async () => {
      if (!(await isUp())) return this.wait();
      this.app.session.update({ connected: true });
      await this.save();
      this.back();
    }, RETRY);
  }
}
