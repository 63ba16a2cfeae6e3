/** Where hands of two people meet: in a motion, and as targets of both people that are asked to be at one place. */

import { type MotionClip, jointAt } from "../body/clip";
import { LEFT, RIGHT } from "../body/skeleton";
import { changeTarget, pathFromMotion, setTarget } from "./constraints";
import { FPS, type Project, type Target, type Vec3, toFrame } from "./model";
import { distance } from "./path";

/** Metres between wrists that meet, at most, and as they are asked to be. */
const NEAR = 0.15;
const GAP = 0.04;
/** Seconds: what is apart for less is one meeting. */
const APART = 0.5;
const MOST = 20;
const WRISTS = [LEFT.wrist, RIGHT.wrist];

export interface Meeting {
  /** The wrist of the first and of the second person. */
  readonly joints: readonly [number, number];
  readonly time: number;
  /** Until when they are together; null: for a moment. */
  readonly until: number | null;
  readonly places: readonly [Vec3, Vec3];
  /** Their targets; null where nobody asks for it. */
  readonly ids: readonly [string, string] | null;
}

/** The middle between the two hands. */
export function middle({ places: [a, b] }: Meeting): Vec3 {
  return [(a[0] + b[0]) / 2, (a[1] + b[1]) / 2, (a[2] + b[2]) / 2];
}

/** What is asked, and what happens in the motion besides, sorted by time. */
export function meetings(project: Project, clip: MotionClip | null): Meeting[] {
  const asked = askedIn(project);
  const isAsked = (one: Meeting) =>
    asked.some(({ time, until }) => one.time < (until ?? time) + APART && (one.until ?? one.time) > time - APART);
  const happen = clip?.people.length === 2 && project.people.length === 2 ? seenIn(clip) : [];
  return [...asked, ...happen.filter((one) => !isAsked(one))].sort((a, b) => a.time - b.time).slice(0, MOST);
}

function askedIn({ people }: Project): Meeting[] {
  const [first, second] = people;
  const isWrist = ({ joint }: Target) => WRISTS.includes(joint);
  return (first?.targets ?? []).filter(isWrist).flatMap((one) => {
    const other = second?.targets.find(
      (two) =>
        isWrist(two) && two.time === one.time && two.until === one.until && distance(one.position, two.position) < NEAR,
    );
    if (!other) return [];
    const { time, until } = one;
    return [
      {
        joints: [one.joint, other.joint] as const,
        time,
        until,
        places: [one.position, other.position] as const,
        ids: [one.id, other.id] as const,
      },
    ];
  });
}

const known = new WeakMap<MotionClip, readonly Meeting[]>();

/** Stretches in which two wrists are near each other. */
function seenIn(clip: MotionClip): readonly Meeting[] {
  const found = known.get(clip) ?? lookedFor(clip);
  known.set(clip, found);
  return found;
}

function lookedFor(clip: MotionClip): Meeting[] {
  return WRISTS.flatMap((mine) =>
    WRISTS.flatMap((other) => {
      const apart = Array.from({ length: clip.frames }, (_, frame) =>
        distance(jointAt(clip, 0, mine, frame / clip.fps), jointAt(clip, 1, other, frame / clip.fps)),
      );
      const runs: [number, number][] = [];
      apart.forEach((metres, frame) => {
        const last = runs.at(-1);
        if (metres > NEAR) return;
        if (last && frame - last[1] < APART * clip.fps) last[1] = frame;
        else runs.push([frame, frame]);
      });
      return runs.map(([begin, end]): Meeting => {
        const stretch = apart.slice(begin, end + 1);
        const nearest = (begin + stretch.indexOf(Math.min(...stretch))) / clip.fps;
        return {
          joints: [mine, other],
          time: toFrame(begin / clip.fps),
          until: end - begin > clip.fps * 0.2 ? toFrame(end / clip.fps) : null,
          places: [jointAt(clip, 0, mine, nearest), jointAt(clip, 1, other, nearest)],
          ids: null,
        };
      });
    }),
  );
}

/** Ask both people to have their hands at a place; who has no path goes as in the motion. */
export function moveMeeting(project: Project, meeting: Meeting, to: Vec3, clip: MotionClip | null): Project {
  const { places, joints, time, until, ids } = meeting;
  const way = places[1].map((value, axis) => value - places[0][axis]!);
  const long = Math.hypot(...way);
  const half = way.map((value) => (long > 1e-6 ? (value / long) * (GAP / 2) : 0));
  return [0, 1].reduce((now, who) => {
    const sign = who ? 1 : -1;
    const place = to.map((value, axis) => value + sign * half[axis]!) as [number, number, number];
    if (ids) return changeTarget(now, who, ids[who]!, { position: place });
    const walked = clip && !now.people[who]!.path ? pathFromMotion(now, who, clip) : now;
    const put = setTarget(walked, who, joints[who]!, time, place);
    const target = put.people[who]!.targets.find(
      (one) => one.joint === joints[who] && Math.abs(one.time - time) < 0.5 / FPS,
    );
    return target && until !== null ? changeTarget(put, who, target.id, { until }) : put;
  }, project);
}
