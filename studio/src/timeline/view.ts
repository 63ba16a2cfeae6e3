/** The timeline as elements: ruler, blocks of words, and tracks of what is asked besides. */

import { type App, duration, shownClip } from "../app/app";
import { h, morph } from "../app/dom";
import { TOUCH, withKey } from "../app/keys";
import { hint } from "./hint";
import { chosenBlocks } from "../app/session";
import { jointName } from "../body/skeleton";
import { UNMET, isMeasurable, isUnmet, pathMiss, poseMiss, targetMiss } from "../project/misses";
import { notesOf } from "../project/goals";
import { stale } from "../project/plan";
import { tips } from "./tip";
import { type Person, type Project, begins, keptTake, length, round } from "../project/model";
import { timed } from "../project/path";
import type { Place } from "../project/places";
import { transitionOf } from "../project/timeline";
import { PARTS } from "../project/tracks";
import { Curves } from "./curves";
import { Figures } from "./figures";
import { partsShown, trackRows } from "./tracks";

export interface TimelineCalls {
  readonly write: (id: string, text: string, second: boolean) => void;
  /** The user is done with a block's words. */
  readonly written: () => void;
}

/** Behind the end of the motion there is room to drag. */
const ROOM = 168;
/** Pixels that are free beside a timeline that fits. */
const FIT = 44;
const LABELS = {
  words: "Words",
  other: "Words 2",
  path: "Path",
  joints: "Joints",
  poses: "Poses",
} as const;

/** What a press of the pointer does to a block's words, as far as that is true of this pointer. */
const WRITE = TOUCH ? "tap twice to write" : "double-click to write";

export class TimelineView {
  /** Pixels of one second. */
  scale = 84;
  /** The block whose words are edited in place; with `second`, those of the second person. */
  editing: { id: string; second: boolean } | null = null;
  private readonly labels = h("div", { class: "labels", "aria-hidden": "true" });
  private readonly content = h("div", { class: "content" });
  private readonly rows = h("div");
  readonly scroll = h("div", { class: "scroll", tabindex: "-1" }, this.content);
  /** Where what is dragged or pasted comes to lie. */
  private readonly landing = h("div", { class: "landing", "aria-hidden": "true", hidden: true });
  private readonly band = h("div", { class: "band", "aria-hidden": "true", hidden: true });
  private readonly figures: Figures;
  private readonly curves: Curves;
  private readonly playhead = h("div", { class: "playhead", "aria-hidden": "true" }, h("i"));

  constructor(
    private readonly app: App,
    root: HTMLElement,
    private readonly calls: TimelineCalls,
  ) {
    root.append(this.labels, this.scroll);
    tips(app, this.scroll);
    this.figures = new Figures(app, this.scroll, () => this.scale);
    this.curves = new Curves(app);
    this.content.append(this.rows, this.figures.canvas, this.band, this.landing, this.playhead);
    app.project.subscribe(() => this.render());
    app.session.subscribe((now, before) => {
      if (now.time !== before.time) this.movePlayhead();
      const keys = ["clips", "selection", "range", "person", "fan", "error", "curves"] as const;
      if (keys.some((key) => now[key] !== before[key]) || (now.curves && now.joint !== before.joint)) this.render();
      if (now.curves && !before.curves) this.content.querySelector(".curves")?.scrollIntoView({ block: "nearest" });
      if (now.error !== before.error)
        this.content.querySelector(".said")?.scrollIntoView({ block: "nearest", inline: "nearest" });
    });
    this.render();
  }

  /** Seconds at a place of the screen. */
  timeAt(clientX: number): number {
    return (clientX - this.content.getBoundingClientRect().left) / this.scale;
  }

  /** Zoom; what is at `clientX`, or at the playhead, stays where it is on the screen. */
  zoom(factor: number, clientX?: number): void {
    const time = clientX === undefined ? this.app.session.value.time : this.timeAt(clientX);
    const x = time * this.scale - this.scroll.scrollLeft;
    this.scale = Math.min(Math.max(this.scale * factor, 4), 400);
    this.render();
    this.scroll.scrollLeft = time * this.scale - x;
  }

  /** All of the motion at once. */
  fit(): void {
    this.zoom((this.scroll.clientWidth - FIT) / Math.max(duration(this.app), 0.2) / this.scale);
    this.scroll.scrollLeft = 0;
  }

  /** Show where what is dragged will begin, and for how long it lies over others; null: nowhere. */
  mark(time: number | null, seconds = 0): void {
    this.landing.hidden = time === null;
    if (time !== null) this.landing.style.cssText = this.span(time, time + seconds);
    this.landing.classList.toggle("over", seconds > 0);
  }

  /** Show the frame that selects blocks, between two places of the window; gives the blocks in it. */
  frame(from: readonly [number, number] | null, to: readonly [number, number] = [0, 0]): string[] {
    this.band.hidden = from === null;
    if (!from) return [];
    const box = this.content.getBoundingClientRect();
    const [left, right] = [Math.min(from[0], to[0]), Math.max(from[0], to[0])];
    const [top, bottom] = [Math.min(from[1], to[1]), Math.max(from[1], to[1])];
    this.band.style.cssText = `left:${left - box.left}px;top:${top - box.top}px;width:${right - left}px;height:${bottom - top}px`;
    const inside = [...this.content.querySelectorAll<HTMLElement>(".block")].filter((one) => {
      const at = one.getBoundingClientRect();
      return at.left < right && at.right > left && at.top < bottom && at.bottom > top;
    });
    return [...new Set(inside.map((one) => one.dataset.id!))];
  }

  edit(id: string, second = false): void {
    this.editing = { id, second };
    this.app.session.update({ selection: { kind: "segment", id } });
    this.render();
    const input = this.content.querySelector<HTMLInputElement>("input.words");
    input?.focus();
    input?.select();
  }

  render(): void {
    const { value } = this.app.project;
    const two = value.people.length > 1;
    // The colour of who is asked.
    const who = (name: keyof typeof LABELS) =>
      two &&
      h("i", { class: `asked who${name === "words" ? 0 : name === "other" ? 1 : this.app.session.value.person}` });
    const tracks = ["words", ...(two ? (["other"] as const) : []), "path", "joints", "poses"] as const;
    morph(
      this.labels,
      [
        h("span", { class: "ruler" }),
        ...tracks.map((name) => h("span", { class: `track ${name}` }, who(name), this.label(name, two))),
        ...partsShown(value, this.app.session.value.person).map((part) =>
          h("span", { class: "track parts" }, who("poses"), part ? PARTS[part].name : "Parts"),
        ),
        this.app.session.value.curves &&
          h(
            "span",
            { class: "track curves" },
            h("i", { class: "height" }),
            "Height",
            h("i", { class: "speed" }),
            "Speed",
          ),
      ].filter((one) => one !== false),
    );
    const end = duration(this.app);
    this.content.style.width = `${end * this.scale + ROOM}px`;
    const rows = [
      this.ruler(end),
      this.words(value, false),
      ...(two ? [this.words(value, true)] : []),
      ...this.asks(value),
      ...this.curves.rows(this.scale),
    ];
    morph(this.rows, rows);
    this.figures.later();
    this.movePlayhead();
  }

  private label(name: keyof typeof LABELS, two: boolean): string {
    if (!two || name === "other") return LABELS[name];
    return name === "words" ? "Words 1" : `${LABELS[name]} ${this.app.session.value.person + 1}`;
  }

  private movePlayhead(): void {
    const x = this.app.session.value.time * this.scale;
    this.playhead.style.transform = `translateX(${x}px)`;
    const said = this.app.session.value.curves && this.content.querySelector(".curves button");
    if (said) said.textContent = this.curves.description();
    if (!this.app.session.value.playing) return;
    const { scrollLeft, clientWidth } = this.scroll;
    if (x < scrollLeft || x > scrollLeft + clientWidth - 40) this.scroll.scrollLeft = Math.max(x - 60, 0);
  }

  private ruler(end: number): HTMLElement {
    const step = [1, 2, 5, 10, 30, 60].find((one) => one * this.scale >= 52) ?? 60;
    const marks = Array.from({ length: Math.floor((end + ROOM / this.scale) / step) + 1 }, (_, index) =>
      h("span", { class: "mark", style: this.left(index * step) }, `${index * step} s`),
    );
    const { range, selection } = this.app.session.value;
    const frozen = this.app.project.value.frozen.map(([from, to]) =>
      h("span", { class: "frozen", style: this.span(from, to), title: "Frozen: stays as it is" }),
    );
    const marked = range && h("span", { class: "range", style: this.span(range[0], range[1]) });
    const overlaps = (keptTake(this.app.project.value)?.overlaps ?? []).map(({ begin, end, depth }) =>
      h("span", {
        class: "overlap",
        style: this.span(begin, end),
        title: `The two are in each other by up to ${Math.round(depth * 100)} cm`,
      }),
    );
    return h(
      "div",
      {
        class: "ruler",
        "data-drag": "ruler",
        "data-key": "ruler",
        "data-same": JSON.stringify([
          this.scale,
          end,
          range,
          this.app.project.value.frozen,
          this.app.project.value.markers,
          selection.kind === "marker" && selection.id,
          overlaps.map((one) => [one.title, one.style.left]),
        ]),
        "aria-label": "Time: drag to scrub, Shift and drag to mark a stretch",
      },
      ...marks,
      ...frozen,
      ...overlaps,
      marked,
      ...this.markers(),
    );
  }

  private markers(): HTMLElement[] {
    const { selection } = this.app.session.value;
    return this.app.project.value.markers.map(({ id, time, name }) =>
      h(
        "button",
        {
          class: `marker${selection.kind === "marker" && selection.id === id ? " chosen" : ""}`,
          style: this.left(time),
          "data-drag": "marker",
          "data-id": id,
          "data-key": id,
          title: `${name} at ${time.toFixed(2)} s`,
          "aria-label": `${name} at ${time.toFixed(2)} seconds`,
          onfocus: () => this.app.session.update({ selection: { kind: "marker", id } }),
        },
        h("span", {}, name),
      ),
    );
  }

  private words(project: Project, second: boolean): HTMLElement {
    const at = begins(project.segments);
    const old = stale(project);
    const blocks = project.segments.flatMap((one, index) => [
      this.block(project, index, at[index]!, second, old.has(one.id)),
      ...(second || index === project.segments.length - 1 ? [] : [this.transition(project, index, at[index + 1]!)]),
    ]);
    const frozen = project.frozen.map(([from, to], index) =>
      h("div", {
        class: "ice",
        "data-key": `ice${index}`,
        style: this.span(from, Math.min(to, at.at(-1)!)),
        "aria-hidden": "true",
      }),
    );
    const add = h(
      "button",
      {
        class: "add",
        "data-act": "add",
        "data-key": "add",
        style: this.left(at.at(-1)!),
        title: withKey("Add a block", "A"),
        "aria-label": "Add a block",
      },
      "+",
    );
    return h(
      "div",
      {
        class: `track words${second ? " other" : ""}`,
        "data-drag": "band",
        "data-key": `words${second}`,
        role: "group",
        "aria-label": second ? "What the second person does" : "What the person does",
      },
      ...blocks,
      ...frozen,
      ...(second ? [] : [add]),
      !second &&
        this.tooltip((at) =>
          at.kind === "segment"
            ? begins(project.segments)[project.segments.findIndex((one) => one.id === at.id)]!
            : null,
        ),
    );
  }

  /** What went wrong here, beside its cause; `time` gives where that is, or null where it is elsewhere. */
  private tooltip(time: (at: Place) => number | null): HTMLElement | false {
    const { error } = this.app.session.value;
    const at = error?.at ? time(error.at) : null;
    if (!error || at === null) return false;
    const left = Math.max(Math.min(at * this.scale, this.scroll.clientWidth + this.scroll.scrollLeft - 440), 4);
    const close = () => this.app.session.update({ error: null });
    return h(
      "p",
      { class: "said", role: "alert", "data-key": "said", style: `left:${round(left)}px` },
      h("span", {}, error.message),
      h("button", { class: "text", onclick: () => this.calls.written() }, "Try again"),
      h("button", { class: "cross", "aria-label": "Close", onclick: close }, "×"),
    );
  }

  /** Whether the last problem belongs to this part of the project. */
  private isWrong(kind: Place["kind"], id?: string): boolean {
    const at = this.app.session.value.error?.at;
    return at?.kind === kind && (!id || !("id" in at) || at.id === id);
  }

  private block(project: Project, index: number, at: number, second: boolean, isOld: boolean): HTMLElement {
    const one = project.segments[index]!;
    const { selection } = this.app.session.value;
    const chosen = chosenBlocks(selection).includes(one.id);
    const isEdited = this.editing?.id === one.id && this.editing.second === second;
    const text = second ? one.other : one.text;
    const shown = text || (second ? "does the same" : WRITE);
    const state = isOld ? "still the old motion" : text || second ? "" : "stands still";
    const words = isEdited
      ? h("input", {
          class: "words",
          value: text,
          "aria-label": "What the person does",
          maxlength: "2000",
          oninput: (event: Event) => this.calls.write(one.id, (event.target as HTMLInputElement).value, second),
          onkeydown: (event: KeyboardEvent) => {
            if (["Enter", "Escape"].includes(event.key)) this.stopEditing(event);
          },
          onblur: () => this.stopEditing(),
        })
      : h("span", { class: text ? "words" : "words empty" }, shown);
    const notes = notesOf(project, one).filter((note) => second === (note.text.trim() === one.other.trim()));
    const before = index > 0 && project.segments[index - 1]!.id;
    const same = [
      index,
      at,
      one.seconds,
      this.scale,
      shown,
      state,
      chosen,
      before,
      this.isWrong("segment", one.id),
      notes.length,
    ];
    return h(
      "div",
      {
        "data-same": isEdited ? null : same.join(),
        class: `block${chosen ? " chosen" : ""}${isOld ? " old" : ""}${this.isWrong("segment", one.id) ? " wrong" : ""}`,
        style: this.span(at, at + one.seconds),
        tabindex: "0",
        role: "group",
        "aria-roledescription": "block",
        "data-drag": second ? "second" : "block",
        "data-id": one.id,
        "data-key": one.id,
        "aria-label": `Block ${index + 1}: ${shown}, ${one.seconds} seconds${state && `, ${state}`}`,
        title: second ? null : WRITE,
        onfocus: () => chosen || this.app.session.update({ selection: { kind: "segment", id: one.id } }),
      },
      words,
      h("small", {}, `${round(one.seconds)} s${state && ` · ${state}`}`),
      notes.length > 0 &&
        h("b", { class: "noted", role: "img", "aria-label": notes.map((note) => note.line).join("; ") }, "?"),
      !second &&
        before &&
        h("i", {
          class: "edge from",
          "data-drag": "seam",
          "data-id": before,
          title: "Drag the seam",
        }),
      !second && h("i", { class: "edge to", "data-drag": "end", "data-id": one.id, title: "Drag the length" }),
    );
  }

  private stopEditing(event?: KeyboardEvent): void {
    event?.stopPropagation();
    if (!this.editing) return;
    const { id } = this.editing;
    this.editing = null;
    this.calls.written();
    this.render();
    if (event) this.content.querySelector<HTMLElement>(`[data-id="${id}"]`)?.focus();
  }

  private transition(project: Project, index: number, seam: number): HTMLElement {
    const half = transitionOf(project, index) / 2;
    return h(
      "div",
      {
        class: "transition",
        "data-same": [seam, half, this.scale].join(),
        "data-key": `t${project.segments[index]!.id}`,
        style: this.span(seam - half, seam + half),
        title: `Transition: ${round(half * 2)} s`,
      },
      h("i", { "data-drag": "transition", "data-id": project.segments[index]!.id }),
    );
  }

  private asks(project: Project): HTMLElement[] {
    const who = Math.min(this.app.session.value.person, project.people.length - 1);
    const person = project.people[who]!;
    return [
      this.pathTrack(project, person, who),
      this.jointTrack(project, person, who),
      this.poseTrack(project, person, who),
      ...trackRows(this.app, who, (from, until) => this.span(from, until)),
    ];
  }

  private pathTrack(project: Project, person: Person, who: number): HTMLElement {
    const seconds = length(project);
    const path = person.path && timed(person.path, seconds);
    const clip = shownClip(this.app);
    const miss = isMeasurable(project, clip) ? pathMiss(clip, who, person, seconds) : null;
    const children = path
      ? [
          h(
            "div",
            {
              class: `way${(miss && miss[0] > 15) || this.isWrong("path") ? " unmet" : ""}`,
              style: this.span(0, path.times.at(-1)!),
            },
            `${path.speed.toFixed(1)} m/s${miss ? ` · ${miss[0].toFixed(0)} cm off` : ""}`,
          ),
          ...path.times.map((time, index) =>
            h("i", {
              class: "dot",
              "data-key": `p${index}`,
              style: this.left(time),
              title: `Point at ${time.toFixed(2)} s`,
            }),
          ),
        ]
      : [hint("path", "Draw a path", "P")];
    const said = this.tooltip((at) => (at.kind === "path" && at.who === who ? 0 : null));
    return h(
      "div",
      { class: "track path", "data-drag": "band", "data-key": "path", "aria-label": "Path" },
      ...children,
      said,
    );
  }

  private jointTrack(project: Project, person: Person, who: number): HTMLElement {
    const clip = shownClip(this.app);
    const { selection } = this.app.session.value;
    const keys = person.targets.map((target) => {
      const miss = isMeasurable(project, clip) ? targetMiss(clip, who, target) : null;
      const chosen = selection.kind === "target" && selection.id === target.id;
      const name = `${jointName(target.joint)} at ${target.time.toFixed(2)} s${miss === null ? "" : `, ${miss.toFixed(1)} cm off`}`;
      const bad = (isMeasurable(project, clip) && isUnmet(clip, who, target)) || this.isWrong("target", target.id);
      const state = `${chosen ? " chosen" : ""}${bad ? " unmet" : ""}`;
      return h(
        "button",
        {
          class: `key${target.until === null ? "" : " pinned"}${state}`,
          style: target.until === null ? this.left(target.time) : this.span(target.time, target.until),
          "data-drag": "target",
          "data-id": target.id,
          "data-key": target.id,
          title: name,
          "aria-label": name,
        },
        target.until === null ? "" : jointName(target.joint),
        target.until !== null && h("i", { class: "edge to", "data-drag": "until", "data-id": target.id }),
      );
    });
    return h(
      "div",
      { class: "track joints", "data-drag": "band", "data-key": "joints", "aria-label": "Targets of joints" },
      ...(keys.length ? keys : [hint("target", "Drag a joint", "T")]),
      this.tooltip((at) =>
        at.kind === "target" && at.who === who ? (person.targets.find((one) => one.id === at.id)?.time ?? null) : null,
      ),
    );
  }

  private poseTrack(project: Project, person: Person, who: number): HTMLElement {
    const clip = shownClip(this.app);
    const { selection } = this.app.session.value;
    const keys = person.poses.map((pose) => {
      const miss = isMeasurable(project, clip) ? poseMiss(clip, who, pose) : null;
      const chosen = selection.kind === "pose" && selection.id === pose.id;
      const name = `${pose.name} at ${pose.time.toFixed(2)} s${miss === null ? "" : `, ${miss.toFixed(1)} cm off`}`;
      return h("button", {
        class: `key pose${chosen ? " chosen" : ""}${(miss !== null && miss > UNMET) || this.isWrong("pose", pose.id) ? " unmet" : ""}`,
        style: this.left(pose.time),
        "data-drag": "pose",
        "data-id": pose.id,
        "data-key": pose.id,
        title: name,
        "aria-label": name,
      });
    });
    return h(
      "div",
      { class: "track poses", "data-drag": "band", "data-key": "poses", "data-drop": "pose", "aria-label": "Poses" },
      ...(keys.length ? keys : [hint("pose", "Keep this pose", "O")]),
      this.tooltip((at) =>
        at.kind === "pose" && at.who === who ? (person.poses.find((one) => one.id === at.id)?.time ?? null) : null,
      ),
    );
  }

  private left(time: number): string {
    return `left:${round(time * this.scale)}px`;
  }

  private span(from: number, to: number): string {
    return `left:${round(from * this.scale)}px;width:${round((to - from) * this.scale)}px`;
  }
}
