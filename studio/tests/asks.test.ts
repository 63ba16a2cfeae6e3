import { describe, expect, it } from "vitest";
import {
  changeTarget,
  pathFromMotion,
  personWithoutPath,
  setPose,
  setTarget,
  setPath,
  shiftTarget,
} from "../src/project/constraints";
import { motionClip } from "../src/body/clip";
import { pathPoint } from "../src/project/path";
import { type Project, type Vec3, exampleProject, keptTake, segment } from "../src/project/model";
import { STANDS_STILL, type SegmentJson, goalOf, timelineOf } from "../src/project/goals";
import { plan, planKey, stale } from "../src/project/plan";
import { freeze, freezeRest, setPeople, write } from "../src/project/timeline";
import type { ComposeRequest } from "../src/server/types";

const TAKE = { motion: "m1", seed: 1, seconds: 6.5, people: 1, how: "drawn" };
const STANDING: Vec3[] = Array.from({ length: 22 }, (_, joint) => [0, joint / 20, 0]);

function asking(edit: (project: Project) => Project): Project {
  return edit({ ...exampleProject(), takes: [TAKE] });
}

describe("targets", () => {
  it("of one joint at one time are one, which moves", () => {
    const project = asking((old) => setTarget(setTarget(old, 0, 21, 1, [0, 1, 0]), 0, 21, 1.02, [0, 1.5, 0]));
    expect(project.people[0]!.targets.map((one) => one.position)).toEqual([[0, 1.5, 0]]);
  });

  it("are the points of a goal file, in the order of time", () => {
    const project = asking((old) => setTarget(setTarget(old, 0, 21, 3, [0, 1, 0]), 0, 21, 1, [0.1234567, 1, 0]));
    expect(goalOf(project.people[0]!, 6.5)).toEqual({
      joints: [
        {
          joint: "right_wrist",
          points: [
            { time: 1, position: [0.123, 1, 0] },
            { time: 3, position: [0, 1, 0] },
          ],
        },
      ],
    });
  });

  it("of one block are seen from where it begins, of several they keep the way as it is", () => {
    const several = asking((old) => setTarget(old, 0, 21, 1, [0, 1, 0]));
    const one = { ...several, segments: several.segments.slice(0, 1) };
    expect(timelineOf(one).path).toBeUndefined();
    expect(timelineOf(one).segments[0]!.goal!.joints).toHaveLength(1);
    expect(personWithoutPath(several)).toBe(0);
    expect(plan(several).missing).toMatchObject({ at: { kind: "path", who: 0 } });
    const walking = Float32Array.from({ length: 130 * 66 }, (_, n) =>
      n % 66 === 2 ? Math.floor(n / 66) / 20 : n % 66 === 3 ? 1 : 0,
    );
    const kept = pathFromMotion(several, 0, motionClip(20, [walking]));
    expect(personWithoutPath(kept)).toBe(-1);
    const { path } = timelineOf(kept).path!;
    expect(path!.points.at(-1)![1]).toBeCloseTo(6.45, 1);
    expect(path!.times.at(-1)).toBe(6.5);
    expect(new Set(path!.facing)).toEqual(new Set([0]));
  });

  it("that are pinned ask for every frame between", () => {
    let project = asking((old) => setTarget(old, 0, 20, 1, [0, 1, 0], "t"));
    project = changeTarget(project, 0, "t", { until: 2 });
    const position = [0, 1, 0];
    expect(goalOf(project.people[0]!, 6.5)!.joints).toEqual([
      {
        joint: "left_wrist",
        points: [
          { time: 1, position },
          { time: 2, position },
        ],
        curve: true,
      },
    ]);
    expect(shiftTarget(project, 0, "t", 99).people[0]!.targets[0]).toMatchObject({ time: 5.5, until: 6.5 });
  });

  it("go before a pose at the same time", () => {
    const project = asking((old) => setTarget(setPose(old, 0, "pose", 2, STANDING), 0, 21, 2, [1, 1, 1]));
    const joints = goalOf(project.people[0]!, 6.5)!.joints!;
    expect(joints).toHaveLength(22);
    expect(joints.find((one) => one.joint === "right_wrist")!.points).toEqual([{ time: 2, position: [1, 1, 1] }]);
  });
});

describe("what is drawn", () => {
  it("is a timeline with its transitions", () => {
    const timeline = timelineOf(exampleProject(), 7);
    expect(timeline.seed).toBe(7);
    expect(timeline.segments).toEqual([
      { text: "a person walks forward", seconds: 3.5, transition: 1 },
      { text: "a person waves with the right hand", seconds: 3 },
    ]);
  });

  it("has somebody stand in a block without words, and asks for words where no block has any", () => {
    const project = { ...exampleProject(), segments: [segment("walk", 2), segment(" ", 2)] };
    const [job] = plan(project).jobs as ComposeRequest[];
    const { segments } = job!.timeline as { segments: SegmentJson[] };
    expect(segments.map((one) => one.text)).toEqual(["walk", STANDS_STILL]);
    const empty = { ...project, segments: [segment(" ", 2), segment("", 2)] };
    const at = { kind: "segment", id: empty.segments[0]!.id };
    const message = "No block has words yet; say what the person does.";
    expect(plan(empty)).toEqual({ jobs: [], missing: { message, at } });
  });

  it("tells which blocks show the motion of other words", () => {
    const [walk, wave, jump] = [segment("walk", 2), segment("wave", 2), segment("jump", 2)];
    const take = { motion: "a", seed: 0, seconds: 6, people: 1, how: "drawn" };
    const project = { ...exampleProject(), segments: [walk, wave, jump], takes: [take] };
    const drawn = { ...project, drawn: planKey(project) };
    expect(stale(drawn)).toEqual(new Set());
    const changed = { ...drawn, segments: [walk, { ...wave, text: "bow" }, jump] };
    expect(stale(changed)).toEqual(new Set([wave.id]));
    const more = segment("run", 1);
    expect(stale({ ...drawn, segments: [walk, more, wave, jump] })).toEqual(new Set([more.id]));
    expect(stale({ ...changed, takes: [] })).toEqual(new Set());
  });

  it("is only what is not frozen, block by block", () => {
    const project = asking((old) => freeze(old, [0, 2]));
    expect(plan(project).jobs).toMatchObject([
      { task: "edit", motion: "m1", prompt: "a person walks forward", between: [[2, 3.5]] },
      { task: "edit", prompt: "a person waves with the right hand", between: [[3.5, 6.5]] },
    ]);
  });

  it("is one block when words change and stretches are frozen", () => {
    const project = asking((old) => freezeRest(old, old.segments[0]!.id));
    const changed = write(project, project.segments[1]!.id, "a person claps");
    expect(changed.base).toBe(keptTake(project));
    expect(plan(changed).jobs).toMatchObject([{ prompt: "a person claps", between: [[3.5, 6.5]] }]);
  });

  it("is told apart by everything that changes the motion, and by nothing else", () => {
    const project = exampleProject();
    expect(planKey({ ...project, name: "other", clips: [] })).toBe(planKey(project));
    expect(planKey({ ...project, seed: 9 })).not.toBe(planKey(project));
  });

  it("is a duet for two people, with words for each where they differ", () => {
    let project = setPeople(exampleProject(), 2);
    project = write(project, project.segments[0]!.id, "a person sits", true);
    project = setPath(project, 1, { points: [pathPoint(0, 1), pathPoint(0, 3)], speed: null, times: null });
    expect(plan(project).jobs).toMatchObject([
      { task: "duet", person: 1, timeline: { segments: [{ text: "a person walks forward :: a person sits" }, {}] } },
    ]);
  });
});
