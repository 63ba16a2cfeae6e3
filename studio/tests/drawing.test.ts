import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { type App, seenTakes } from "../src/app/app";
import type { LiveState } from "../src/app/live";
import { Deeds } from "../src/app/deeds";
import { Drawer, MARKS } from "../src/app/drawing";
import { newSession } from "../src/app/session";
import { Signal } from "../src/app/signal";
import { type MotionClip, POSE, jointAt, motionClip, overlaid } from "../src/body/clip";
import { History } from "../src/project/history";
import { exampleProject } from "../src/project/model";
import { planKey } from "../src/project/plan";
import { write } from "../src/project/timeline";

/** Stands for the server: jobs wait until a test lets them go on. */
class Jobs {
  /** Motions that the server no longer has. */
  readonly lost = new Set<unknown>();
  readonly asked: Record<string, unknown>[] = [];
  private readonly streams: ReadableStreamDefaultController<Uint8Array>[] = [];

  answer(path: string, init: RequestInit = {}): Response {
    if (path === "jobs") {
      const job = JSON.parse(String(init.body)) as Record<string, unknown>;
      if (this.lost.has(job.kept_from)) return Response.json({ error: "there is no such motion" }, { status: 404 });
      this.asked.push(job);
      return Response.json({ id: String(this.asked.length - 1) });
    }
    if (path.startsWith("motions/"))
      return new Response(new Float32Array(130 * (POSE + 3)), {
        headers: { "Motion-Fps": "20", "Motion-People": "1" },
      });
    if (!path.endsWith("/events")) return Response.json({});
    const body = new ReadableStream<Uint8Array>({ start: (one) => void this.streams.push(one) });
    init.signal?.addEventListener("abort", () => this.streams.at(-1)!.error(init.signal!.reason));
    return new Response(body);
  }

  level(level: number, row = 0): void {
    this.send("level", { level, of: 24, row, people: 1, frames: 130, begin: 0, positions: base64(130) });
  }

  end(): void {
    const number = this.asked.length - 1;
    const measures = this.asked[number]!.kept_from ? { redrawn: [1] } : {};
    const results = [{ id: `motion${number}`, seed: 1, seconds: 6.5, frames: 130, people: 1, measures }];
    this.send("done", { id: String(number), state: "done", error: null, results });
  }

  private send(name: string, data: unknown): void {
    this.streams.at(-1)!.enqueue(new TextEncoder().encode(`event: ${name}\ndata: ${JSON.stringify(data)}\n\n`));
    if (name === "done") this.streams.at(-1)!.close();
  }
}

function base64(frames: number): string {
  return btoa("\0".repeat(frames * POSE * 4));
}

function begun(): { app: App; jobs: Jobs; drawer: Drawer; deeds: Deeds } {
  const jobs = new Jobs();
  vi.stubGlobal("fetch", (path: string, init?: RequestInit) => Promise.resolve(jobs.answer(path, init)));
  const app = {
    project: new History(exampleProject()),
    session: newSession(),
    denoising: new Signal<readonly MotionClip[]>([]),
    live: new Signal<LiveState | null>(null),
  };
  const drawer = new Drawer(app);
  return { app, jobs, drawer, deeds: new Deeds(app, drawer) };
}

async function drawn({ app, jobs, drawer }: ReturnType<typeof begun>): Promise<void> {
  const count = jobs.asked.length;
  if (!app.session.value.drawing) await vi.waitFor(() => expect(jobs.asked.length).toBe(count + 1));
  await vi.waitFor(() => expect(app.session.value.drawing).not.toBeNull());
  await vi.waitFor(() => jobs.end());
  await drawer.finished();
}

/** Milliseconds that a picture takes. */
let picture = 16;

beforeEach(() => {
  picture = 16;
  vi.stubGlobal("window", globalThis);
  vi.stubGlobal("requestAnimationFrame", (call: () => void) => setTimeout(call, picture / 2));
});
afterEach(() => {
  vi.unstubAllGlobals();
  performance.clearMarks();
});

describe("a draw", () => {
  it("is one job, whose poses are the preview from a quarter of its calls on", async () => {
    const page = begun();
    const { app, jobs, drawer } = page;
    drawer.schedule();
    await vi.waitFor(() => expect(jobs.asked).toHaveLength(1));
    expect(jobs.asked[0]).toMatchObject({ task: "compose", levels: true });
    await vi.waitFor(() => jobs.level(5));
    await vi.waitFor(() => expect(app.denoising.value).not.toEqual([]));
    expect(performance.getEntriesByName(MARKS.preview)).toHaveLength(0);
    for (const level of [6, 7, 24]) jobs.level(level);
    await vi.waitFor(() => expect(performance.getEntriesByName(MARKS.preview)).toHaveLength(1));
    await drawn(page);
    expect(app.project.value.takes.map((one) => one.motion)).toEqual(["motion0"]);
    expect(app.denoising.value).toEqual([]);
    drawer.again();
    await vi.waitFor(() => expect(jobs.asked).toHaveLength(2));
    expect(jobs.asked[1]).toMatchObject({ levels: 6 });
  });

  it("keeps the blocks of the motion that is there, as long as the server has it", async () => {
    const page = begun();
    const { app, jobs, drawer } = page;
    drawer.schedule();
    await drawn(page);
    expect(jobs.asked[0]).not.toHaveProperty("kept_from");
    const wave = (text: string) =>
      app.project.change("write", (old) => write(old, old.segments[1]!.id, text), { typed: true });
    wave("a person bows");
    await drawn(page);
    expect(jobs.asked[1]).toMatchObject({ task: "compose", kept_from: "motion0" });
    expect(app.project.value.takes).toMatchObject([{ motion: "motion1", how: "changed" }]);
    drawer.all();
    await drawn(page);
    expect(jobs.asked[2]).not.toHaveProperty("kept_from");
    expect(app.project.value.takes).toMatchObject([{ motion: "motion2", how: "drawn" }]);
    wave("a person jumps");
    await drawn(page);
    expect(jobs.asked[3]).toMatchObject({ kept_from: "motion2" });
    jobs.lost.add("motion3");
    wave("a person kicks");
    await drawn(page);
    expect(jobs.asked).toHaveLength(5);
    expect(jobs.asked[4]).not.toHaveProperty("kept_from");
    app.project.change("draw four takes", (old) => ({ ...old, count: 4 }));
    await vi.waitFor(() => expect(jobs.asked).toHaveLength(6));
    expect(jobs.asked[5]).not.toHaveProperty("kept_from");
    drawer.stop();
  });

  it("of four takes shows all of them on their way, each once where pictures are slow", async () => {
    const page = begun();
    const { app, jobs, drawer } = page;
    picture = 120;
    drawer.schedule();
    await drawn(page);
    app.project.change("draw four takes", (old) => ({ ...old, count: 4 }));
    await vi.waitFor(() => expect(jobs.asked).toHaveLength(2));
    expect(jobs.asked[1]).toMatchObject({ count: 4 });
    await vi.waitFor(() => jobs.level(6, 0));
    jobs.level(6, 1);
    await vi.waitFor(() => expect(app.denoising.value).toHaveLength(2));
    expect(seenTakes(app)).toEqual(app.denoising.value);
    await new Promise((resume) => setTimeout(resume, 2 * picture));
    const [first] = app.denoising.value;
    for (const row of [2, 3]) jobs.level(6, row);
    for (const row of [0, 1, 2, 3]) jobs.level(12, row);
    await vi.waitFor(() => expect(app.denoising.value).toHaveLength(4));
    await new Promise((resume) => setTimeout(resume, 30));
    expect(app.denoising.value[0]).toBe(first);
    drawer.stop();
    expect(seenTakes(app)).toEqual(app.session.value.clips);
  });

  it("shows no more than its preview where pictures are slow", async () => {
    const { app, jobs, drawer } = begun();
    picture = 120;
    drawer.schedule();
    await vi.waitFor(() => jobs.level(6));
    await vi.waitFor(() => expect(app.denoising.value).not.toEqual([]));
    const preview = app.denoising.value;
    await new Promise((resume) => setTimeout(resume, 2 * picture));
    jobs.level(12);
    await new Promise((resume) => setTimeout(resume, 30));
    expect(app.denoising.value).toBe(preview);
  });

  it.each([
    ["has drawn the same", { takes: [{ motion: "other", seed: 1, seconds: 6.5, people: 1, how: "drawn" }] }],
    ["wrote something else", { seed: 99 }],
  ])("is given up where another page %s", async (what, more) => {
    const { app, jobs, drawer } = begun();
    drawer.schedule();
    await vi.waitFor(() => expect(app.session.value.drawing).not.toBeNull());
    const { value } = app.project;
    const drawn = what === "has drawn the same" ? planKey(value) : "";
    app.project.follow({ ...value, ...more, drawn }, "elsewhere");
    expect(app.session.value.drawing).toBeNull();
    await vi.waitFor(() => jobs.end()).catch(() => undefined);
    await new Promise((resume) => setTimeout(resume, 30));
    expect(app.project.value.takes.map((one) => one.motion)).toEqual("takes" in more ? ["other"] : []);
    expect(jobs.asked).toHaveLength(1);
  });

  it("on its way is finished before a stretch of it is frozen", async () => {
    const page = begun();
    const { app, jobs, drawer, deeds } = page;
    drawer.schedule();
    await drawn(page);
    drawer.again();
    app.session.update({ range: [0, 2] });
    const freezing = deeds.freeze();
    await vi.waitFor(() => expect(jobs.asked).toHaveLength(2));
    expect(app.project.value.frozen).toEqual([]);
    await vi.waitFor(() => jobs.end());
    await freezing;
    expect(app.project.value.base?.motion).toBe("motion1");
    await vi.waitFor(() => expect(jobs.asked).toHaveLength(3));
    expect(jobs.asked[2]).toMatchObject({ task: "edit", motion: "motion1" });
  });
});

describe("words of two blocks in a motion with frozen stretches", () => {
  it("are both drawn where the second ones come before the first are drawn", () => {
    const base = { motion: "m", seed: 1, seconds: 6.5, people: 1, how: "drawn" };
    const old = { ...exampleProject(), takes: [base], base, frozen: [[0, 6.5] as const] };
    const [one, two] = old.segments;
    const first = write(old, one!.id, "a person runs", false, true);
    expect(first.frozen).toEqual([[3.5, 6.5]]);
    expect(write(first, two!.id, "a person jumps", false, true).frozen).toEqual([[0, 3.5]]);
    expect(write(first, two!.id, "a person jumps", false, false).frozen).toEqual([]);
  });
});

describe("a part of a clip", () => {
  it("lies in the clip at its time, for one of its people, and makes it no longer", () => {
    const people = [new Float32Array(80 * POSE), new Float32Array(80 * POSE)];
    const part = motionClip(20, [new Float32Array(20 * POSE).fill(1)]);
    const looks = people.map(() => new Float32Array(80 * 3).fill(1));
    const clip = overlaid(motionClip(40, people, looks), part, 1, 1.5);
    const heights = (who: number) => Array.from({ length: 80 }, (_, n) => jointAt(clip, who, 0, n / 40)[1]);
    expect(heights(0).every((one) => one === 0)).toBe(true);
    expect(heights(1).indexOf(1)).toBe(60);
    // Where the head looks there is not known.
    expect(clip.looks!.map((one) => one.indexOf(0))).toEqual([-1, 180]);
    expect(clip.frames).toBe(80);
    expect(people[1]!.every((one) => one === 0)).toBe(true);
  });
});
