/** New, open, recent, save as: the folder holds several projects, and none is overwritten. */

import { type Project, blankProject, hasWords, length, segment } from "../project/model";
import { addSegment } from "../project/timeline";
import { type ProjectRow, blocksOf, projectRows } from "../server/api";
import { type App, fail } from "./app";
import type { Drawer } from "./drawing";
import type { Saver } from "./saving";

export class Projects {
  constructor(
    private readonly app: App,
    private readonly saver: Saver,
    private readonly drawer: Drawer,
  ) {}

  /** A new project, in which the first question is asked. */
  blank(): Promise<boolean> {
    return this.replace("New project", () => this.saver.begin(blankProject()), true);
  }

  /** A project out of a file becomes one of the folder; the one that was open stays there. */
  async add(project: Project): Promise<void> {
    await this.replace("Open", () => this.saver.begin(project));
  }

  async open({ id, name }: Pick<ProjectRow, "id" | "name">): Promise<void> {
    if (id !== this.app.session.value.stamp.id) await this.replace(`Open ${name}`, () => this.saver.open(id));
  }

  /** Go on in a copy of another name; what was saved of this one stays as it is. */
  saveAs(name: string): Promise<boolean> {
    return this.replace("Save as", () => this.saver.begin({ ...this.app.project.value, name }));
  }

  rows(): Promise<readonly ProjectRow[]> {
    return projectRows();
  }

  /** Answer the first question: the sentence becomes a block for each of its actions. */
  async start(sentence: string, seed?: number): Promise<void> {
    try {
      const blocks = await blocksOf(sentence);
      this.app.session.update({ welcome: false, time: 0, playing: true, selection: { kind: "none" } });
      this.app.project.change("say what happens", (old) => ({
        ...old,
        seed: seed ?? old.seed,
        segments: blocks.map((one) => segment(one.text, one.seconds)),
        frozen: [],
        base: null,
        only: null,
      }));
    } catch (error) {
      fail(this.app, error);
    }
  }

  /** Put a sentence behind what is there, a block for each of its actions. */
  async goOn(sentence: string): Promise<void> {
    if (!hasWords(this.app.project.value)) return this.start(sentence);
    try {
      const blocks = await blocksOf(sentence);
      this.app.session.update({ time: length(this.app.project.value), playing: true, selection: { kind: "none" } });
      this.app.project.change("say what happens next", (old) =>
        blocks.reduce((now, one) => addSegment(now, one.text, one.seconds), old),
      );
    } catch (error) {
      fail(this.app, error);
    }
  }

  /** Answer the first question in a project of its own. */
  async startAnew(sentence: string): Promise<void> {
    if (await this.blank()) await this.start(sentence);
  }

  private async replace(what: string, deed: () => Promise<void>, welcome = false): Promise<boolean> {
    try {
      this.drawer.stop();
      this.app.session.update({ welcome: false });
      await deed();
      this.app.session.update({ welcome, dialog: null, tool: "select", playing: false });
      this.drawer.loadTakes();
      if (!welcome) this.drawer.schedule();
      return true;
    } catch (error) {
      fail(this.app, error, what);
      return false;
    }
  }
}
