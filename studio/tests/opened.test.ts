import { describe, expect, it } from "vitest";
import { setPose, setTarget, setPath } from "../src/project/constraints";
import { checked } from "../src/project/file";
import { type TimelineJson, timelineOf } from "../src/project/goals";
import { type Project, type Vec3, exampleProject } from "../src/project/model";
import { opened } from "../src/project/opened";
import { placeOf, withoutKeys } from "../src/project/places";
import { setPeople } from "../src/project/timeline";

const STANDING: Vec3[] = Array.from({ length: 22 }, (_, joint) => [joint / 50, joint / 20, 0]);
const PATH = {
  speed: 1,
  times: null,
  points: [
    { x: 0, z: 0, stop: 0, facing: null },
    { x: 0, z: 2, stop: 1, facing: 90 },
    { x: 1, z: 3, stop: 0, facing: null },
  ],
};

/** Through the file and back: the timeline that comes out again. */
function again(timeline: object, person = 0): TimelineJson {
  const json = JSON.parse(JSON.stringify(timeline)) as Record<string, unknown>;
  return timelineOf(checked(JSON.parse(JSON.stringify(opened(json, "t", person)))));
}

function asking(...edits: ((project: Project) => Project)[]): Project {
  return edits.reduce((project, edit) => edit(project), exampleProject());
}

describe("a timeline of the page", () => {
  it("comes in whole and goes out the same: path, targets, a pin, a pose", () => {
    const project = asking(
      (old) => setPath(old, 0, PATH),
      (old) => setTarget(old, 0, 21, 1, [0.3, 1.5, 1]),
      (old) => setTarget(old, 0, 20, 3, [0.3, 1, 2]),
      (old) => setPose(old, 0, "pose", 2, STANDING),
    );
    const pinned = { ...project.people[0]!.targets[1]!, until: 3.5 };
    const whole = {
      ...project,
      people: [{ ...project.people[0]!, targets: [project.people[0]!.targets[0]!, pinned] }],
    };
    const timeline = timelineOf(whole);
    const back = opened(JSON.parse(JSON.stringify(timeline)), "t");
    expect(back.people[0]!.path!.points.length).toBe(timeline.path!.path!.points.length);
    expect(back.people[0]!.targets.map((one) => [one.joint, one.time, one.until])).toEqual([
      [20, 3, 3.5],
      [21, 1, null],
    ]);
    expect(back.people[0]!.poses.map((one) => one.positions)).toEqual([STANDING]);
    expect(again(timeline)).toEqual(timeline);
  });

  it("of one block keeps its targets without a path", () => {
    const project = asking(
      (old) => ({ ...old, segments: old.segments.slice(0, 1) }),
      (old) => setTarget(old, 0, 21, 1, [0.3, 1.5, 1]),
    );
    const timeline = timelineOf(project);
    expect(timeline.segments[0]!.goal).toBeDefined();
    expect(again(timeline)).toEqual(timeline);
  });

  it("of two people keeps both, the words of each and whose the path is", () => {
    const project = asking(
      (old) => setPeople(old, 2),
      (old) => setPath(old, 1, PATH),
    );
    const both = { ...project, segments: [{ ...project.segments[0]!, other: "a person sits" }, project.segments[1]!] };
    const timeline = timelineOf(both);
    const back = opened(JSON.parse(JSON.stringify(timeline)), "t", 1);
    expect(back.people.map((one) => one.path !== null)).toEqual([false, true]);
    expect(back.segments.map((one) => one.other)).toEqual(["a person sits", ""]);
    expect(again(timeline, 1)).toEqual(timeline);
  });
});

describe("a timeline of somebody else", () => {
  const given = {
    seed: 4,
    guidance: 3,
    segments: [
      { text: "walk", seconds: 2, transition: 0.5, guidance: 2 },
      { text: "sit", seconds: 3, goal: { poses: [{ time: 1, from: "0123456789abcdef.npz" }] } },
    ],
    path: {
      path: { svg: "eight.svg", width: 4 },
      joints: [
        { joint: "head", points: [{ time: 1, position: [null, 1.1, null] }] },
        { joint: "left_wrist", points: [{ time: 1, position: [0.4, 1, 0.3] }] },
      ],
    },
  };

  it("keeps what the page has no handles for", () => {
    const project = opened(given, "t");
    expect(project.people[0]!.targets.length).toBe(1);
    const back = again(given);
    expect({ ...back, path: undefined }).toEqual({ ...given, path: undefined });
    expect(back.path!.path).toEqual(given.path.path);
    expect([...back.path!.joints!].reverse()).toEqual(given.path.joints);
  });

  it("gives up the file's path when a point is dragged, and only then", () => {
    const path = {
      path: {
        points: [
          [0, 0],
          [0, 3],
        ],
      },
    };
    const timeline = { seed: 1, segments: [{ text: "walk", seconds: 3 }], path };
    expect(again(timeline)).toEqual(timeline);
    const project = opened(timeline, "t");
    const moved = setPath(project, 0, { ...project.people[0]!.path!, given: null });
    expect(timelineOf(moved).path!.path!.times).toEqual([0, 3]);
  });
});

describe("a sentence of the server", () => {
  const project = asking(
    (old) => setPath(old, 0, PATH),
    (old) => setTarget(old, 0, 21, 1, [0.3, 3.5, 1]),
  );
  const [target] = project.people[0]!.targets;
  const high = "the timeline, path: path: the goal asks for right_wrist at 1.00 s 3.50 m high; keep it below 3 m";

  it.each([
    [high, "path", { kind: "target", who: 0, id: target!.id }],
    [
      "the timeline, segments[1].seconds: 'seconds' must be a number",
      "segments[1].seconds",
      { kind: "segment", id: project.segments[1]!.id },
    ],
    ["segment 2 ('x') of 1 s is shorter than the halves", "", { kind: "segment", id: project.segments[1]!.id }],
    ["the timeline, path.path: path: 'path' cannot be walked", "path.path", { kind: "path", who: 0 }],
    [
      "path: 'joints[0].points[0].time' must be 0 to 2",
      "path.joints[0].points[0].time",
      { kind: "target", who: 0, id: target!.id },
    ],
    ["the server failed", "", null],
  ])("is put where it belongs: %s", (sentence, where, place) => {
    expect(placeOf(project, sentence, where)).toEqual(place);
  });

  it("loses the line of a file that nobody wrote", () => {
    expect(withoutKeys(high)).toBe("the goal asks for right wrist at 1.00 s 3.50 m high; keep it below 3 m");
  });
});
