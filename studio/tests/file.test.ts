import { describe, expect, it } from "vitest";
import { setTarget } from "../src/project/constraints";
import { ProjectError, read, stampOf, written } from "../src/project/file";
import { exampleProject } from "../src/project/model";
import { halfSeconds, snap } from "../src/project/snap";
import { takeOf } from "../src/server/api";
import { events } from "../src/server/events";

describe("a project file", () => {
  it("gives back what was written", () => {
    const project = {
      ...setTarget(exampleProject(), 0, 5, 1, [1, 2, 3]),
      frozen: [[0, 1]] as const,
      name: "Ångström 走",
    };
    const file = written(project, { id: "film", revision: 7 });
    expect(read(file)).toEqual(project);
    expect(JSON.parse(file)).toMatchObject({ version: 2, id: "film", revision: 7 });
    expect(stampOf(JSON.parse(file))).toEqual({ id: "film", revision: 7 });
  });

  it("keeps what is told of a take", () => {
    const result = { id: "0123456789abcdef", seed: 4, seconds: 2, frames: 40, people: 2 };
    const happened = [{ sentence: "walks 2.0 m forward" }, null];
    const notes = [{ text: "yodels", line: "nothing like 'yodels'", instead: ["sings"] }];
    const measures = { overlaps: [{ begin: 1, end: 1.5, depth: 0.06 }] };
    const remarks = ["3 steps asked; 4 steps drawn", notes[0]!.line];
    const take = takeOf({ ...result, happened, remarks, notes, measures }, "drawn");
    expect([take.notes, take.overlaps]).toEqual([notes, measures.overlaps]);
    expect(take.told).toEqual(["Person 1 walks 2.0 m forward", "3 steps asked; 4 steps drawn"]);
    const project = { ...exampleProject(), takes: [take] };
    expect(read(written(project, { id: "film", revision: 1 })).takes).toEqual([take]);
    expect(takeOf(result, "drawn").told).toEqual([]);
  });

  it("of version 1 is read as one of today, and says no id", () => {
    const { version: _, ...old } = exampleProject();
    const file = JSON.stringify({ format: "motionloom studio", version: 1, ...old });
    expect(read(file)).toEqual({ ...old, version: 2 });
    expect(stampOf(JSON.parse(file))).toBeNull();
  });

  it.each([null, 5, [], { id: "a" }, { id: "a/b", revision: 1 }, { id: 5, revision: 1 }, { id: "a", revision: 1e300 }])(
    "says no state where it cannot be one: %j",
    (found) => expect(stampOf(found)).toBeNull(),
  );

  it.each([
    ["{", "it is not JSON"],
    ["[]", "must be a mapping"],
    ['{"version": 3}', "has version 3"],
    ['{"version": 1, "segments": []}', "has no segments"],
    ['{"version": 1, "segments": [{"id": "a", "text": "b", "seconds": 1e9}]}', "segments[0].seconds must be 0.2 to 60"],
    [
      '{"version": 1, "segments": [{"id": "a", "text": "b", "seconds": 1}], "takes": [{"motion": "../x", "seconds": 1}]}',
      "names no motion",
    ],
  ])("is refused with a sentence: %s", (text, sentence) => {
    expect(() => read(text)).toThrow(ProjectError);
    expect(() => read(text)).toThrow(sentence);
  });
});

describe("snapping", () => {
  it("catches on what is near, else on a frame", () => {
    expect(snap(1.46, halfSeconds(3), 0.1)).toBe(1.5);
    expect(snap(1.33, halfSeconds(3), 0.1)).toBe(1.35);
    expect(snap(1.46, halfSeconds(3), 0.1, true)).toBe(1.45);
    expect(snap(1.46, [1.48, 1.5], 0.1)).toBe(1.48);
  });
});

describe("server-sent events", () => {
  it("are read whole, however the stream is cut", () => {
    const text = 'event: progress\ndata: {"done":1}\n\n: still there\n\nevent: done\ndata: {"id":"x"}\n\n';
    for (let cut = 0; cut <= text.length; cut += 1) {
      const first = events(text.slice(0, cut));
      const second = events(first.rest + text.slice(cut));
      expect([...first.events, ...second.events]).toEqual([
        { name: "progress", data: '{"done":1}' },
        { name: "done", data: '{"id":"x"}' },
      ]);
      expect(second.rest).toBe("");
    }
  });
});
