import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import type { App } from "../src/app/app";
import type { Start } from "../src/app/saving";
import { type Project, exampleProject } from "../src/project/model";

/** Stands for the server: it has one project, counts its states, and refuses what was not made from the last one. */
class Server {
  saved: Record<string, unknown> | null = null;
  /** Answers instead of a good one, each once; "lost": it is done, and the answer does not come. */
  readonly bad: (Response | "lost")[] = [];
  readonly aside: string[] = [];
  damaged = false;
  away = false;

  async answer(path: string, { method = "GET", body, headers }: RequestInit = {}): Promise<Response> {
    if (this.away) throw new TypeError("nobody answers");
    if (path === "health") return Response.json({ ok: true });
    if (path === "project/aside") return this.putAside();
    if (this.damaged) return Response.json({ error: "project.json is not JSON" }, { status: 422 });
    if (path === "project/stamp") return Response.json(this.saved && this.stamp());
    if (method === "GET") return Response.json(this.saved);
    const bad = method === "PUT" ? this.bad.shift() : undefined;
    if (bad instanceof Response) return bad;
    const done = this.save(path, JSON.parse(String(body)), (headers as Record<string, string>)["X-Client"]!);
    if (bad === "lost") throw new TypeError("the answer was lost");
    return done;
  }

  private save(path: string, value: Record<string, unknown>, by: string): Response {
    const there = this.saved && (this.saved.written as { by: string; from: number });
    const isOwn = there?.by === by && (value.revision as number) >= there.from;
    const { id, revision } = this.stamp();
    const over = new URLSearchParams(path.split("?")[1]).get("over");
    const follows = !this.saved || (value.id === id && (value.revision === revision || isOwn));
    if (!follows && over !== `${id}.${revision}`) return Response.json({ error: "stale" }, { status: 409 });
    const from = isOwn ? there!.from : (revision ?? 0);
    this.saved = { ...value, revision: Number(revision ?? 0) + 1, written: { by, from } };
    return Response.json({ saved: 1, ...this.stamp() });
  }

  private putAside(): Response {
    this.aside.push("project.1.json");
    this.damaged = false;
    this.saved = null;
    return Response.json({ kept: "project.1.json" });
  }

  private stamp(): { id?: unknown; revision?: unknown } {
    return { id: this.saved?.id, revision: this.saved?.revision };
  }

  get words(): unknown[] {
    return (this.saved!.segments as { text: string }[]).map((one) => one.text);
  }
}

class Channel {
  static all: Channel[] = [];
  onmessage: () => void = () => undefined;
  constructor() {
    Channel.all.push(this);
  }
  postMessage(): void {
    for (const one of Channel.all) if (one !== this) one.onmessage();
  }
}

let server: Server;
let browser: Map<string, string>;
let downloads: string[];

beforeEach(() => {
  vi.useFakeTimers();
  server = new Server();
  browser = new Map();
  downloads = [];
  Channel.all = [];
  vi.stubGlobal("window", globalThis);
  vi.stubGlobal("fetch", (path: string, init?: RequestInit) => server.answer(path, init));
  vi.stubGlobal("BroadcastChannel", Channel);
  vi.stubGlobal("addEventListener", () => undefined);
  vi.stubGlobal("document", {
    hidden: false,
    addEventListener: () => undefined,
    createElement: () => ({
      set download(name: string) {
        downloads.push(name);
      },
      click: () => undefined,
    }),
  });
  vi.stubGlobal("localStorage", {
    getItem: (key: string) => browser.get(key) ?? null,
    setItem: (key: string, value: string) => browser.set(key, value),
    removeItem: (key: string) => browser.delete(key),
    key: (index: number) => [...browser.keys()][index] ?? null,
    get length() {
      return browser.size;
    },
  });
});
afterEach(() => {
  vi.useRealTimers();
  vi.unstubAllGlobals();
});

interface Page {
  readonly app: App;
  readonly begin: Start;
  readonly saver: { settle(choice: "copy" | "theirs" | "mine"): Promise<void> };
  /** Was called to draw what is not drawn. */
  readonly drew: ReturnType<typeof vi.fn>;
  words(): string[];
  write(text: string): void;
}

/** A tab: its modules are its own, as its name at the server is. */
async function opened(): Promise<Page> {
  vi.resetModules();
  const { Saver, restored } = await import("../src/app/saving");
  const { newSession } = await import("../src/app/session");
  const { Signal } = await import("../src/app/signal");
  const { History } = await import("../src/project/history");
  const begin = await restored();
  const app: App = {
    project: new History<Project>(begin.project),
    session: newSession(),
    denoising: new Signal<readonly never[]>([]),
    live: new Signal<null>(null),
  } as unknown as App;
  const drew = vi.fn();
  const saver = new Saver(app, begin, drew);
  const edit = (text: string) => (old: Project) => ({
    ...old,
    segments: [{ ...old.segments[0]!, text }, ...old.segments.slice(1)],
  });
  return {
    app,
    begin,
    saver,
    drew,
    words: () => app.project.value.segments.map((one) => one.text),
    write: (text) => app.project.change("write", edit(text)),
  };
}

const film = (name: string, more: Record<string, unknown> = {}): Record<string, unknown> => ({
  ...exampleProject(),
  name,
  id: name,
  revision: 5,
  written: { by: "somebody", from: 4 },
  ...more,
});

const keep = (value: Record<string, unknown>, more: Record<string, unknown> = {}): void => {
  const entry = { project: value, pending: true, edited: true, client: "before", ...more };
  browser.set(`motionloom-studio:${String(value.id)}`, JSON.stringify(entry));
  browser.set("motionloom-studio:last", String(value.id));
};

const passes = (milliseconds = 600) => vi.advanceTimersByTimeAsync(milliseconds);
const drawn = (page: Page, motion: string) =>
  page.app.project.amend((old) => ({ ...old, takes: [{ motion, seed: 1, seconds: 1, people: 1, how: "drawn" }] }));

describe("a page that begins", () => {
  it("never takes what this browser keeps of another project, and keeps that", async () => {
    server.saved = film("B");
    keep(film("A", { name: "unsaved work of A" }));
    const { app, begin } = await opened();
    expect([app.project.value.name, begin.conflict, begin.pending]).toEqual(["B", null, false]);
    await passes(10_000);
    expect(server.saved.name).toBe("B");
    expect(browser.get("motionloom-studio:A")).toContain("unsaved work of A");
    server.saved = film("A");
    expect((await opened()).app.project.value.name).toBe("unsaved work of A");
  });

  it("goes on with what the same project's server never got", async () => {
    server.saved = film("A");
    keep(film("A", { name: "unsaved" }));
    const { app } = await opened();
    await passes();
    expect([app.project.value.name, server.saved.name, server.saved.revision]).toEqual(["unsaved", "unsaved", 6]);
    expect(app.session.value.saved).toBe("saved");
  });

  it.each([
    ["somebody", true, "unsaved", true],
    ["before", true, "unsaved", false],
    ["somebody", false, "A", false],
  ])("where %s saved meanwhile and edits here are %s has %s and asks: %s", async (by, edited, name, asks) => {
    server.saved = film("A", { written: { by, from: 3 } });
    keep(film("A", { name: "unsaved", revision: 4 }), { edited });
    const { app } = await opened();
    await passes(5000);
    expect([app.project.value.name, app.session.value.conflict !== null]).toEqual([name, asks]);
    expect(server.saved.name).toBe(asks ? "A" : name);
  });

  it.each([
    ["a newer version", film("C", { version: 3 }), "has version 3"],
    ["something else", { kept: 1 }, "has version nothing"],
    ["no JSON", null, "is not JSON"],
  ])("with %s lets it be put aside and says so", async (_, saved, why) => {
    server.saved = saved;
    server.damaged = saved === null;
    const { app, begin } = await opened();
    expect(server.aside).toEqual(["project.1.json"]);
    expect(app.session.value.told).toContain(why);
    expect(app.session.value.told).toContain("stays in the project folder as project.1.json");
    expect([begin.isNew, app.project.value.name]).toEqual([true, "Untitled"]);
  });

  it("asks where changes belong that no server ever had", async () => {
    keep(film("A", { revision: 0 }));
    const page = await opened();
    await passes(5000);
    expect([page.app.project.value.name, server.saved]).toEqual(["A", null]);
    expect(page.app.session.value.conflict).toEqual({ stamp: null, project: null });
    await page.saver.settle("mine");
    expect(server.saved).toMatchObject({ name: "A", id: "A", revision: 1 });
  });

  it("asks about what a page kept that knew no ids, and forgets it where it is the same", async () => {
    server.saved = film("A");
    browser.set("motionloom-studio", JSON.stringify({ project: film("old", { version: 1 }), pending: true }));
    const { app } = await opened();
    expect([app.project.value.name, app.session.value.conflict?.project?.name]).toEqual(["old", "A"]);
    browser.set("motionloom-studio", JSON.stringify({ project: server.saved, pending: true }));
    expect((await opened()).begin.conflict).toBeNull();
  });
});

describe("two pages", () => {
  it("see each other's work, and none asks who only looked and drew", async () => {
    server.saved = film("A");
    const [one, two] = [await opened(), await opened()];
    one.write("first");
    await passes();
    expect(two.words()[0]).toBe("first");
    // Both draw what was written, and at the same moment.
    drawn(one, "m1");
    drawn(two, "m2");
    await passes(5000);
    expect([one, two].map((page) => page.app.session.value.conflict)).toEqual([null, null]);
    expect(two.app.project.value.takes).toEqual(one.app.project.value.takes);
    expect([one, two].map((page) => page.app.session.value.saved)).toEqual(["saved", "saved"]);
    two.write("second");
    await passes();
    expect(one.words()[0]).toBe("second");
    expect(one.app.project.undoLabel).toBe("what another page did");
  });

  it("draw once what the other wrote and has not drawn, after a while", async () => {
    server.saved = film("A");
    const [one, two] = [await opened(), await opened()];
    one.write("first");
    await passes(14_000);
    expect(two.drew).not.toHaveBeenCalled();
    await passes(60_000);
    expect([one.drew.mock.calls.length, two.drew.mock.calls.length]).toEqual([0, 1]);
  });

  it("of one new folder begin the same project", async () => {
    const [one, two] = [await opened(), await opened()];
    drawn(one, "m1");
    drawn(two, "m2");
    await passes(5000);
    expect(two.app.project.value).toEqual(one.app.project.value);
    expect(two.app.session.value.stamp).toEqual(one.app.session.value.stamp);
    expect([one, two].map((page) => page.app.session.value.conflict)).toEqual([null, null]);
  });

  it.each([
    ["copy", "first", "first", ["A_mine.loom.json"]],
    ["theirs", "first", "first", []],
    ["mine", "second", "second", []],
  ] as const)("that change the same state ask, and %s is done", async (choice, here, there, files) => {
    server.saved = film("A");
    const [one, two] = [await opened(), await opened()];
    one.write("first");
    two.write("second");
    await passes(9000);
    expect(server.words[0]).toBe("first");
    expect(two.words()[0]).toBe("second");
    expect(two.app.session.value.conflict?.project?.segments[0]!.text).toBe("first");
    expect(one.app.session.value.conflict).toBeNull();
    two.write("second");
    await two.saver.settle(choice);
    await passes(9000);
    expect([two.words()[0], server.words[0], downloads]).toEqual([here, there, files]);
    expect(one.words()[0]).toBe(there);
    expect([one, two].map((page) => page.app.session.value.conflict)).toEqual([null, null]);
    expect((await opened()).begin).toMatchObject({ conflict: null, pending: false });
  });

  it("asks again where a third one saved while it was asked", async () => {
    server.saved = film("A");
    const [one, two] = [await opened(), await opened()];
    one.write("first");
    two.write("second");
    await passes();
    one.write("third");
    await passes();
    await two.saver.settle("mine");
    expect(server.words[0]).toBe("third");
    expect(two.app.session.value.conflict?.project?.segments[0]!.text).toBe("third");
    await two.saver.settle("mine");
    expect(server.words[0]).toBe("second");
  });
});

describe("a save", () => {
  it("waits for the one before, and is not taken for somebody else's where an answer was lost", async () => {
    server.saved = film("A");
    const page = await opened();
    page.write("one");
    await passes(499);
    server.bad.push("lost");
    await passes(1);
    expect(page.app.session.value.connected).toBe(false);
    page.write("two");
    await passes(5000);
    expect([server.words[0], page.app.session.value.conflict]).toEqual(["two", null]);
    expect(page.app.session.value.saved).toBe("saved");
  });

  it("that finds no room says so, not 'saved', and is tried again", async () => {
    server.saved = film("A");
    const page = await opened();
    const full = () => Response.json({ error: "the disk of the project folder is full" }, { status: 507 });
    server.bad.push(full(), full());
    page.write("one");
    await passes();
    const error = { message: "the disk of the project folder is full", isFull: true };
    expect(page.app.session.value).toMatchObject({ saved: "here", error });
    await passes(5000);
    expect(page.app.session.value).toMatchObject({ saved: "here", error });
    await passes(5000);
    expect(page.app.session.value).toMatchObject({ saved: "saved", error: null });
    expect(server.words[0]).toBe("one");
  });

  it("of a page whose server came back as another one asks, or takes that over", async () => {
    server.saved = film("A");
    const [worked, looked] = [await opened(), await opened()];
    server.away = true;
    worked.write("mine");
    await passes(5000);
    server.away = false;
    server.saved = film("B");
    await passes(9000);
    expect([server.saved.name, worked.app.project.value.name, looked.app.project.value.name]).toEqual(["B", "A", "B"]);
    expect(worked.app.session.value.conflict?.project?.name).toBe("B");
    expect(looked.app.session.value.conflict).toBeNull();
  });
});
