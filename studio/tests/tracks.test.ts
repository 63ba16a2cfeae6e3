import { describe, expect, it } from "vitest";
import { read, written } from "../src/project/file";
import { type Project, type Take, exampleProject } from "../src/project/model";
import { plan } from "../src/project/plan";
import { withFixedTake } from "../src/project/fixedTake";
import { freeze, setPeople } from "../src/project/timeline";
import {
  PARTS,
  addTrack,
  changeTrack,
  fights,
  shiftTrack,
  trackCommands,
  trackKeys,
  trackText,
} from "../src/project/tracks";

const TAKE: Take = { motion: "old", seed: 1, seconds: 6.5, people: 1, how: "drawn" };

function waving(from = 1, until = 3, old: Project = exampleProject()): Project {
  return changeTrack(addTrack(old, 0, [from, until], "t"), 0, "t", { text: "it's waving" });
}

describe("a part with words of its own", () => {
  it("is an edit behind the timeline, which keeps the rest of the body", () => {
    const { jobs } = plan(waving());
    expect(jobs.map((job) => job.task)).toEqual(["compose", "edit"]);
    expect(jobs[1]).toMatchObject({ prompt: "it's waving", between: [[1, 3]], person: 0, count: 1 });
    expect(jobs[1]).toMatchObject({ keep: ["lower_body", "torso", "head_neck", "left_arm"] });
    expect(plan(addTrack(exampleProject(), 0, [1, 3])).jobs).toHaveLength(1);
    expect(plan(setPeople(waving(), 2)).jobs.map((job) => job.task)).toEqual(["duet", "edit"]);
  });

  it("stays within the motion and goes into the file", () => {
    const moved = shiftTrack(waving(), 0, "t", 60);
    expect(moved.people[0]!.tracks[0]).toMatchObject({ from: 4.5, until: 6.5 });
    const takes = [{ ...TAKE, tracks: trackKeys(moved), under: "older" }];
    expect(read(written({ ...moved, takes }, { id: "a", revision: 1 }))).toEqual({ ...moved, takes });
    const wrong = written(moved, { id: "a", revision: 1 }).replace("right_arm", "tail");
    expect(() => read(wrong)).toThrow('people[0].tracks[0].part is "tail", which names no part of the body.');
  });

  it("is drawn over what is frozen as far as it is newer", () => {
    const project = waving(1, 5);
    const drawn = { ...project, takes: [{ ...TAKE, tracks: trackKeys(project) }], drawn: "x" };
    const spans = (one: Project) =>
      plan(one).jobs.flatMap((job) => (job.task === "edit" && job.keep ? [job.between] : []));
    expect(spans(freeze(drawn, [0, 3]))).toEqual([[[3, 5]]]);
    expect(spans(freeze({ ...drawn, takes: [TAKE] }, [0, 3]))).toEqual([[[1, 5]]]);
    expect(plan(withFixedTake(project, TAKE)).jobs).toEqual([]);
    const newer = plan({ ...waving(1, 5, withFixedTake(exampleProject(), TAKE)), count: 4 }).jobs;
    expect(newer).toMatchObject([{ motion: "old", between: [[1, 5]], count: 4 }]);
  });

  it("follows a clip, or looks at a point or the other person", () => {
    const clip = { motion: "waves", name: "waves", seconds: 2 };
    const looks = addTrack(exampleProject(), 0, [0, 2], "t", { look: [1, 1.5, 2] });
    const edit = (one: Project) => plan(one).jobs[1];
    expect(edit(changeTrack(waving(), 0, "t", { clip }))).toMatchObject({ source: "waves", between: [[1, 3]] });
    expect(edit(looks)).toMatchObject({ look: [1, 1.5, 2], between: [[0, 2]] });
    expect(edit(looks)).not.toHaveProperty("keep");
    const other = changeTrack(looks, 0, "t", { look: "other" });
    expect(edit(other)).toBeUndefined();
    expect(edit(setPeople(other, 2))).toMatchObject({ look_at: 1, person: 0 });
    expect(trackCommands(looks, "a")).toEqual(["edit a.npz --look 1 1.5 2 --between 0 2 --seed 1 --out a_1.npz"]);
    expect(trackCommands(changeTrack(waving(), 0, "t", { clip, part: "arms" }), "a")).toEqual([
      "edit a.npz --source waves.npz --keep lower_body --keep torso --keep head_neck --between 1 3 --seed 1 --out a_1.npz",
    ]);
    expect(() => trackCommands(setPeople(other, 2), "a")).toThrow("parts of two people are in no timeline file");
    expect(read(written(other, { id: "a", revision: 1 }))).toEqual(other);
  });

  it("of the head says in words what it does, or looks somewhere", () => {
    const nods = changeTrack(addTrack(exampleProject(), 0, [1, 3], "t"), 0, "t", { part: "head", text: "nods twice" });
    expect(plan(nods).jobs[1]).toMatchObject({ prompt: "nods twice", keep: PARTS.head.keep, between: [[1, 3]] });
    expect(trackText(nods.people[0]!.tracks[0]!)).toBe("nods twice");
    const looks = changeTrack(nods, 0, "t", { look: [1, 1.5, 2] });
    expect(plan(looks).jobs[1]).not.toHaveProperty("prompt");
    expect(trackText(looks.people[0]!.tracks[0]!)).toBe("looks at a point");
    expect(trackCommands(nods, "a")[0]).toContain("edit a.npz 'nods twice' --keep lower_body --keep torso");
  });

  it("is smoothed, the whole body or a part", () => {
    const smooth = addTrack(exampleProject(), 0, [1, 2], "t", { smooth: 0.3 });
    const edit = (one: Project) => plan(one).jobs[1];
    expect(edit(smooth)).toMatchObject({ smooth: 0.3, keep: [], between: [[1, 2]] });
    expect(edit(smooth)).not.toHaveProperty("prompt");
    expect(edit(changeTrack(smooth, 0, "t", { part: "head" }))).toMatchObject({ smooth: 0.3, keep: PARTS.head.keep });
    expect(trackCommands(smooth, "a")).toEqual(["edit a.npz --smooth 0.3 --between 1 2 --seed 1 --out a_1.npz"]);
    expect(read(written(smooth, { id: "a", revision: 1 }))).toEqual(smooth);
  });

  it("is a command of its own beside a timeline file", () => {
    expect(trackCommands(waving(), "a")).toEqual([
      "edit a.npz 'it'\\''s waving' --keep lower_body --keep torso --keep head_neck --keep left_arm --between 1 3 --seed 1 --out a_1.npz",
    ]);
  });
});

describe("a target and a part that want the same joint", () => {
  it("are said with who wins, as long as they meet in time", () => {
    const target = { id: "w", joint: 21, time: 1.2, until: null, position: [0, 1, 0] as const };
    const waves = waving(1, 3);
    const person = { ...waves.people[0]!, targets: [target] };
    expect(fights(person)).toHaveLength(1);
    expect(fights(person)[0]).toContain("wins");
    expect(fights({ ...person, targets: [{ ...target, joint: 20 }] })).toEqual([]);
    expect(fights({ ...person, targets: [{ ...target, time: 3.5 }] })).toEqual([]);
    expect(fights({ ...person, targets: [{ ...target, time: 0.2, until: 1.5 }] })).toHaveLength(1);
  });
});
