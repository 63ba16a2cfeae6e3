import { describe, expect, it } from "vitest";
import { motionClip } from "../src/body/clip";
import { COUNT, LEFT, RIGHT } from "../src/body/skeleton";
import { meetings, middle, moveMeeting } from "../src/project/meetings";
import { exampleProject } from "../src/project/model";
import { plan } from "../src/project/plan";
import { setPeople } from "../src/project/timeline";

const FPS = 20;

/** Two people a metre apart whose right hands are together from second 1 to 2. */
function shaking() {
  const people = [-0.5, 0.5].map((z, who) => {
    const data = new Float32Array(4 * FPS * COUNT * 3);
    for (let frame = 0; frame < 4 * FPS; frame += 1)
      for (let joint = 0; joint < COUNT; joint += 1) {
        const x = joint === LEFT.hip || joint === LEFT.wrist ? (who ? -0.3 : 0.3) : 0;
        const isMet = joint === RIGHT.wrist && frame >= FPS && frame <= 2 * FPS;
        data.set(isMet ? [0, 1.1, Math.sign(z) * 0.03] : [x, 1, z], (frame * COUNT + joint) * 3);
      }
    return data;
  });
  return motionClip(FPS, people);
}

describe("meetings of hands", () => {
  const clip = shaking();
  const project = setPeople(exampleProject(), 2);

  it("are found in the motion, where and how long", () => {
    const [one, ...others] = meetings(project, clip);
    expect(others).toEqual([]);
    expect(one).toMatchObject({ joints: [RIGHT.wrist, RIGHT.wrist], time: 1, until: 2, ids: null });
    expect(middle(one!)[1]).toBeCloseTo(1.1);
    expect(meetings(exampleProject(), clip)).toEqual([]);
  });

  it("are moved for both people, who go as they went, in one job", () => {
    const moved = moveMeeting(project, meetings(project, clip)[0]!, [0.1, 1.4, 0], clip);
    const targets = moved.people.map((person) => person.targets);
    expect(targets.map((all) => all.length)).toEqual([1, 1]);
    for (const [n, [one]] of targets.entries()) {
      expect(one).toMatchObject({ joint: RIGHT.wrist, time: 1, until: 2 });
      expect(one!.position).toEqual([0.1, 1.4, n ? 0.02 : -0.02]);
    }
    const [job] = plan(moved).jobs as {
      person: number;
      timeline: { path: unknown };
      other_goals: { joints: unknown[] };
    }[];
    expect(job).toMatchObject({ task: "duet", person: 0 });
    expect(job!.timeline.path).toBeDefined();
    expect(job!.other_goals.joints).toHaveLength(1);
  });

  it("that are asked stand for those of the motion, and are moved on", () => {
    const once = moveMeeting(project, meetings(project, clip)[0]!, [0.1, 1.4, 0], clip);
    const [asked, ...others] = meetings(once, clip);
    expect(others).toEqual([]);
    expect(asked!.ids).toEqual(once.people.map((person) => person.targets[0]!.id));
    const twice = moveMeeting(once, asked!, [0.1, 1.2, 0], clip);
    expect(twice.people.map((person) => person.targets[0]!.position[1])).toEqual([1.2, 1.2]);
  });
});
