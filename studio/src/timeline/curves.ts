/** How high a joint is and how fast, over time, in a row of the timeline. */

import { type App, shownClip } from "../app/app";
import { h, svg } from "../app/dom";
import { withKey } from "../app/keys";
import { type MotionClip, jointAt } from "../body/clip";
import { TARGETS, jointName } from "../body/skeleton";

/** Pixels of the row, and of it above the lines, where the words are, and below them. */
const [TALL, TOP, BOTTOM] = [96, 26, 6];
/** The least that the row has room for: metres, and metres per second. */
const LEAST = 1;

export interface Course {
  /** Metres over the floor, for each frame. */
  readonly height: readonly number[];
  /** Metres per second. */
  readonly speed: readonly number[];
}

/** The course of a joint of somebody. */
export function courseOf(clip: MotionClip, person: number, joint: number): Course {
  const places = Array.from({ length: clip.frames }, (_, frame) => jointAt(clip, person, joint, frame / clip.fps));
  const speed = places.map((_, frame) => {
    const [first, last] = [Math.max(frame - 1, 0), Math.min(frame + 1, places.length - 1)];
    const [a, b] = [places[first]!, places[last]!];
    return last > first ? (Math.hypot(b[0] - a[0], b[1] - a[1], b[2] - a[2]) * clip.fps) / (last - first) : 0;
  });
  return { height: places.map((place) => place[1]), speed };
}

export class Curves {
  private of: [MotionClip, number, number] | null = null;
  private course: Course = { height: [], speed: [] };

  constructor(private readonly app: App) {}

  /** The row, or nothing where it is not shown. */
  rows(scale: number): HTMLElement[] {
    const { curves, person, joint } = this.app.session.value;
    const clip = shownClip(this.app);
    if (!curves) return [];
    if (!clip) this.of = null;
    else if (!this.of || [clip, person, joint].some((one, n) => one !== this.of![n])) {
      this.of = [clip, person, joint];
      this.course = courseOf(clip, person, joint);
    }
    const { height, speed } = this.of ? this.course : { height: [], speed: [] };
    const width = this.of ? clip!.seconds * scale : 0;
    const line = (name: string, values: readonly number[]) => {
      const most = values.reduce((a, b) => Math.max(a, b), LEAST);
      const y = (value: number) => TALL - BOTTOM - ((TALL - TOP - BOTTOM) * Math.max(value, 0)) / most;
      const points = values.map((value, frame) => `${((frame / clip!.fps) * scale).toFixed(1)},${y(value).toFixed(1)}`);
      return svg("polyline", { class: name, points: points.join(" "), fill: "none" });
    };
    return [
      h(
        "div",
        {
          class: "track curves",
          "data-drag": "ruler",
          "data-key": "curves",
          role: "group",
          "aria-label": "Height and speed of a joint",
        },
        svg(
          "svg",
          { width: width.toFixed(0), height: TALL, "aria-hidden": "true" },
          line("height", height),
          line("speed", speed),
        ) as unknown as HTMLElement,
        h(
          "button",
          {
            class: "text",
            title: withKey("Another joint; or choose one on the stage", "T"),
            onclick: () => this.next(),
          },
          this.description(),
        ),
      ),
    ];
  }

  /** What the joint does at the playhead. */
  description(): string {
    const { joint, time } = this.app.session.value;
    const frame = this.of && Math.min(Math.round(time * this.of[0].fps), this.course.height.length - 1);
    if (frame === null) return jointName(joint);
    const [height, speed] = [this.course.height[frame] ?? 0, this.course.speed[frame] ?? 0];
    return `${jointName(joint)}: ${height.toFixed(2)} m high, ${speed.toFixed(2)} m/s`;
  }

  private next(): void {
    const { session } = this.app;
    const index = TARGETS.indexOf(session.value.joint as (typeof TARGETS)[number]);
    session.update({ joint: TARGETS[(index + 1) % TARGETS.length]! });
  }
}
