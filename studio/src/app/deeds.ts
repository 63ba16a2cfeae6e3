/** What one does with motions besides asking for them: continue, loop, switch, put aside, take a pose. */

import { mirrored, turnedTo } from "../body/posed";
import { POSE, facingAt, jointAt, places, poseAt } from "../body/clip";
import { changePose, fillPoses, moveTo, neighbours, poseNear, setPose } from "../project/constraints";
import {
  type Clip,
  type Project,
  type Take,
  type Vec3,
  begins,
  clamp,
  keptTake,
  length,
  round,
  segment,
  toFrame,
} from "../project/model";
import { isUpToDate } from "../project/plan";
import { withContinuedTake, blocksOfClip, withFixedTake, withMotion } from "../project/fixedTake";
import { freeze, freezeRest, unfrozen, write } from "../project/timeline";
import { type Result, motion, takeOf } from "../server/api";
import { type App, fail, shownClip } from "./app";
import type { Drawer } from "./drawing";
import { TOUCH } from "./keys";
import { NOTHING } from "./session";

const FUTURES = 5;
const FUTURE_SECONDS = 2;
const SWITCH_SECONDS = 1;

export class Deeds {
  constructor(
    private readonly app: App,
    private readonly drawer: Drawer,
  ) {}

  /** Change the words of a block while they are typed. */
  write(id: string, text: string, second: boolean): void {
    const options = { merge: `text:${id}${second}`, typed: true };
    this.app.project.change("write", (old) => write(old, id, text, second, isUpToDate(old)), options);
  }

  /** Keep what is marked, or the block that is selected, as it is; of a draw that is on its way, what comes of it. */
  async freeze(): Promise<void> {
    const { range, selection } = this.app.session.value;
    const { segments } = this.app.project.value;
    const index = selection.kind === "segment" ? segments.findIndex((one) => one.id === selection.id) : -1;
    const at = begins(segments);
    const stretch = range ?? (index >= 0 ? ([at[index]!, at[index + 1]!] as const) : null);
    if (!stretch)
      return this.say(
        `${TOUCH ? "Select" : "Mark a stretch on the ruler with Shift and drag, or select"} a block; then freeze it.`,
      );
    await this.drawer.finished();
    this.app.project.change("freeze a stretch", (old) => freeze(old, stretch));
    this.app.session.update({ range: null });
  }

  /** Draw one block anew; the rest stays as it is. */
  async redraw(id: string): Promise<void> {
    await this.drawer.finished();
    this.app.project.change("draw only this block", (old) => ({
      ...freezeRest({ ...old, only: null }, id),
      seed: old.seed + 1,
    }));
  }

  unfreeze(): void {
    this.app.project.change("unfreeze", unfrozen);
  }

  /** What could come next: several futures of the kept take, to choose from. */
  async predict(): Promise<void> {
    await this.drawer.finished();
    const take = keptTake(this.app.project.value);
    if (!take) return this.say("There is no motion yet that could go on.");
    const common = { seconds: FUTURE_SECONDS, count: FUTURES, seed: this.app.project.value.seed };
    const results = await this.drawer.once(
      // Futures of two people are drawn together: what one does depends on the other.
      take.people > 1
        ? { task: "duet", past: take.motion, ...common }
        : { task: "predict", motion: take.motion, ...common },
    );
    if (!results?.length) return;
    const clips = await Promise.all(results.map((one) => motion(one.id)));
    const fan = { clips, motions: results.map((one) => one.id), past: take.seconds };
    this.app.session.update({ fan, time: Math.max(take.seconds - 0.4, 0), playing: true, sideBySide: false });
  }

  chooseFuture(index: number): void {
    const { fan } = this.app.session.value;
    const [clip, id] = [fan?.clips[index], fan?.motions[index]];
    if (!fan || !clip || !id) return;
    this.app.session.update({ fan: null, clips: [clip] });
    const take: Take = {
      motion: id,
      seed: this.app.project.value.seed,
      seconds: clip.seconds,
      people: clip.people.length,
      how: "continued",
    };
    this.app.project.change(`go on with future ${index + 1}`, (old) => withContinuedTake(old, take));
  }

  /** Make the end of the take go over into its beginning. */
  async loop(): Promise<void> {
    await this.drawer.finished();
    const take = keptTake(this.app.project.value);
    if (!take) return this.say("There is no motion yet to make a loop of.");
    let motion = take.motion;
    let result: Result | undefined;
    for (let person = 0; person < take.people; person += 1) {
      const { seed } = this.app.project.value;
      const results = await this.drawer.once({ task: "edit", motion, person, loop: true, seed, count: 1 });
      result = results?.[0];
      if (!result) return;
      motion = result.id;
    }
    if (result) this.take(result, "looped", "close the loop");
  }

  /** One clip going over into another. */
  async switch(from: Clip, to: Clip): Promise<void> {
    const results = await this.drawer.once({
      task: "switch",
      motion: from.motion,
      target: to.motion,
      seconds: SWITCH_SECONDS,
      seed: this.app.project.value.seed,
      count: 1,
    });
    const [result] = results ?? [];
    if (!result) return;
    const names = [
      segment(from.name, round(from.seconds)),
      segment("", SWITCH_SECONDS),
      segment(to.name, round(to.seconds)),
    ];
    this.put(result, `switch from ${from.name} to ${to.name}`, names, "switched");
  }

  /** A clip becomes what is on the timeline; words then change stretches of it. */
  putOnTimeline(clip: Clip): void {
    const take: Take = { motion: clip.motion, seed: 0, seconds: clip.seconds, people: 1, how: "from a file" };
    this.app.session.update({ time: 0, selection: NOTHING, fan: null });
    this.app.project.change(`open ${clip.name}`, (old) => withMotion(old, take, blocksOfClip(clip.name, clip.seconds)));
  }

  /** Put the kept take aside, among the clips. */
  keepAside(): void {
    const { value } = this.app.project;
    const take = keptTake(value);
    if (!take || value.clips.some((one) => one.motion === take.motion)) return;
    const name =
      value.segments
        .map((one) => one.text)
        .find((text) => text)
        ?.slice(0, 32) ?? "take";
    this.app.project.change("put a take aside", (old) => ({
      ...old,
      clips: [...old.clips, { motion: take.motion, name, seconds: take.seconds }],
    }));
  }

  addClip(result: Result, name: string): Clip {
    const clip: Clip = { motion: result.id, name, seconds: result.seconds };
    this.app.project.change(`add ${name}`, (old) => ({ ...old, clips: [...old.clips, clip] }));
    return clip;
  }

  /** Ask for the pose that is shown at the playhead. */
  keyframe(): void {
    const clip = shownClip(this.app);
    if (!clip) return this.say("There is no pose yet; draw a motion first.");
    const { time, person } = this.app.session.value;
    const positions = places(poseAt(clip, person, time, new Float32Array(POSE)));
    this.putPose("pose at hand", positions, "keyframe a pose");
  }

  /** The pose that is selected or, where none is, the one at the playhead. */
  poseAtHand(): readonly Vec3[] | null {
    const { selection, time, person } = this.app.session.value;
    const own = this.app.project.value.people[person]?.poses.find(
      (one) => selection.kind === "pose" && one.id === selection.id,
    );
    const clip = shownClip(this.app);
    return own?.positions ?? (clip && places(poseAt(clip, person, time, new Float32Array(POSE))));
  }

  copyPose(): void {
    const pose = this.poseAtHand();
    if (!pose) return this.say("There is no pose yet; draw a motion first.");
    this.app.session.update({
      pose,
      told: `The pose is copied; ${TOUCH ? "Paste" : "Alt V"} keyframes it at the playhead.`,
    });
  }

  /** Ask for the copied pose at the playhead, where the person is then and as they face. */
  pastePose(): void {
    const { pose, time, person } = this.app.session.value;
    const clip = shownClip(this.app);
    if (!pose) return this.say("No pose is copied yet; copy one first.");
    const [x, , z] = clip ? jointAt(clip, person, 0, time) : pose[0]!;
    const positions = clip ? turnedTo(pose, [x, z], facingAt(clip, person, time)) : pose;
    this.putPose("pasted pose", positions, "paste a pose");
  }

  /** Exchange left and right of the selected pose, or ask for the one at the playhead so. */
  mirrorPose(): void {
    const { selection, person } = this.app.session.value;
    const pose = this.poseAtHand();
    if (!pose) return this.say("There is no pose yet; draw a motion first.");
    const positions = mirrored(pose);
    if (selection.kind !== "pose") return this.putPose("mirrored pose", positions, "mirror a pose");
    this.app.project.change("mirror a pose", (old) => changePose(old, person, selection.id, { positions }));
  }

  /** Poses between the selected one and the next. */
  fillPoses(count: number): void {
    const { selection, person } = this.app.session.value;
    const [, next] = selection.kind === "pose" ? neighbours(this.app.project.value, person, selection.id) : [];
    if (selection.kind !== "pose" || !next)
      return this.say("Select a pose behind which there is another one; poses are put between the two.");
    this.app.project.change("poses in between", (old) => fillPoses(old, person, selection.id, count));
  }

  /** Ask for a pose at the playhead, and select it. */
  private putPose(name: string, positions: readonly Vec3[], label: string): void {
    const { person } = this.app.session.value;
    const time = clamp(toFrame(this.app.session.value.time), 0, length(this.app.project.value));
    this.app.project.change(label, (old) => setPose(old, person, name, time, positions));
    const put = poseNear(this.app.project.value, person, time);
    if (put) this.app.session.update({ selection: { kind: "pose", id: put.id }, time: put.time, playing: false });
  }

  /** Ask for a pose of another clip, where the person is at the playhead. */
  async poseFrom(clip: Clip, at = clip.seconds / 2): Promise<void> {
    const { time, person } = this.app.session.value;
    const other = await motion(clip.motion);
    const positions = places(poseAt(other, 0, at, new Float32Array(POSE)));
    const shown = shownClip(this.app);
    const [x, , z] = shown ? jointAt(shown, person, 0, time) : [0, 0, 0];
    this.putPose(clip.name, moveTo(positions, { x, z }), "keyframe a pose");
  }

  /** What was done live becomes the motion; each stretch of the same words is a block. */
  putRecording(result: Result, segments: Project["segments"]): void {
    this.put(result, "keep what was done live", segments, "live");
  }

  fail(error: unknown): void {
    fail(this.app, error);
  }

  say(message: string): void {
    this.app.session.update({ error: { message, at: null } });
  }

  private take(result: Result, how: string, label: string): void {
    this.app.project.change(label, (old) => withFixedTake(old, takeOf(result, how)));
  }

  private put(result: Result, label: string, segments: Project["segments"], how: string): void {
    this.app.session.update({ time: 0, selection: NOTHING });
    this.app.project.change(label, (old) => withMotion(old, takeOf(result, how), segments));
  }
}
