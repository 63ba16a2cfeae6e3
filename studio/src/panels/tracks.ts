/** A part of the body that does something of its own: which, what, and when. */

import { type App, shownClip } from "../app/app";
import { h } from "../app/dom";
import { withKey } from "../app/keys";
import { chosenBlocks } from "../app/session";
import { facingAt, jointAt } from "../body/clip";
import { HEAD } from "../body/skeleton";
import {
  type Project,
  type Range,
  type Track,
  type Vec3,
  OTHER,
  begins,
  keptTake,
  length,
  newId,
  round,
} from "../project/model";
import { ORDER, PARTS, SMOOTH, SMOOTHEST, type Part, addTrack, changeTrack, fights } from "../project/tracks";
import { numberField, section, textButton, wordsArea } from "./parts";

/** Seconds where neither a stretch is marked nor a block selected. */
const USUAL = 2;
/** Parts that follow no clip: it would take the person elsewhere. */
const WORDED: readonly Part[] = ["body", "legs"];
/** Neither a clip nor smoothing. */
const PLAIN = { clip: null, smooth: 0 } as const;
/** What can be said of a head, which is turned by rules (`motionloom.goals.heads`). */
const HEAD_WORDS = "What the head does: nods, shakes, looks left, right, up, down or around";
/** Metres before somebody's eyes. */
const AHEAD = 2;

/** Give a part words of its own: in what is marked, in the selected block, or from the playhead on. */
export function newTrack(app: App): void {
  const id = newId();
  const stretch = stretchOf(app);
  const { person } = app.session.value;
  app.project.change("give a part words of its own", (old) => addTrack(old, person, stretch, id));
  writeTrack(app, id);
}

/** Let the head look at a point, or at the other person where there is one. */
export function newLook(app: App): void {
  const id = newId();
  const stretch = stretchOf(app);
  const { person } = app.session.value;
  const look = app.project.value.people.length > 1 ? OTHER : pointAhead(app, stretch[0]);
  app.project.change("look at something", (old) => addTrack(old, person, stretch, id, { look }));
  writeTrack(app, id);
}

/** Even out what trembles: in what is marked, in the selected block, or from the playhead on. */
export function newSmoothing(app: App): void {
  const id = newId();
  const stretch = stretchOf(app);
  const { person } = app.session.value;
  app.project.change("smooth a stretch", (old) => addTrack(old, person, stretch, id, { smooth: SMOOTH }));
  writeTrack(app, id);
}

function stretchOf(app: App): Range {
  const { range, selection, time } = app.session.value;
  const { segments } = app.project.value;
  const index = segments.findIndex((one) => one.id === chosenBlocks(selection)[0]);
  const at = begins(segments);
  return range ?? (index < 0 ? [time, time + USUAL] : [at[index]!, at[index + 1]!]);
}

/** A place before somebody's eyes, a little to the left. */
function pointAhead(app: App, time: number): Vec3 {
  const clip = shownClip(app);
  if (!clip) return [AHEAD, 1.5, AHEAD];
  const { person } = app.session.value;
  const [x, y, z] = jointAt(clip, person, HEAD, time);
  const angle = ((facingAt(clip, person, time) + 35) * Math.PI) / 180;
  return [round(x + AHEAD * Math.sin(angle)), round(y), round(z + AHEAD * Math.cos(angle))];
}

/** Select a stretch and write in it. */
export function writeTrack(app: App, id: string): void {
  app.session.update({ selection: { kind: "track", id } });
  document.querySelector(`.own[data-id="${id}"]`)?.scrollIntoView({ block: "nearest", inline: "nearest" });
  document.querySelector<HTMLElement>(`textarea[data-key="${id}"]`)?.focus();
}

export function trackSection(app: App, track: Track, remove: () => void): HTMLElement {
  const who = app.session.value.person;
  const { value } = app.project;
  const change = (label: string, part: Partial<Track>, typed = false) =>
    app.project.change(label, (old) => changeTrack(old, who, track.id, part), {
      merge: typed ? `track:${track.id}` : "",
      typed,
    });
  const { look } = track;
  const isPlain = !track.clip && !track.smooth;
  const isWorded = (track.part !== "head" || look === null) && isPlain;
  const isPoint = track.part === "head" && isPlain && look !== null && look !== OTHER;
  const notes = (keptTake(value)?.notes ?? []).filter((note) => note.text.trim() === track.text.trim());
  return section(
    value.people.length > 1 ? `Part of person ${who + 1}` : "Part",
    h(
      "select",
      {
        class: "choice",
        value: track.part,
        "aria-label": "Which part",
        onchange: (event: Event) => {
          const part = (event.target as HTMLSelectElement).value as Part;
          const look = part === "head" ? track.look : null;
          change("choose a part", { part, look, clip: WORDED.includes(part) ? null : track.clip });
        },
      },
      ...ORDER.map((part) => h("option", { value: part, selected: part === track.part }, PARTS[part].name)),
    ),
    doingField(app, value, track, (part) => change("choose what a part does", part)),
    isWorded &&
      wordsArea(track.part === "head" ? HEAD_WORDS : "What this part does", track.id, track.text, (text) =>
        change("write", { text }, true),
      ),
    isPoint &&
      h(
        "div",
        { class: "three" },
        ...["x", "y", "z"].map((axis, n) =>
          numberField(
            axis,
            look[n]!,
            "m",
            (metres) =>
              metres !== null &&
              change("look elsewhere", {
                look: look.map((old, k) => (k === n ? metres : old)) as [number, number, number],
              }),
            { min: -1000, max: 1000 },
          ),
        ),
      ),
    track.smooth > 0 &&
      numberField(
        "Evens out what is quicker than",
        track.smooth,
        "s",
        (seconds) => seconds !== null && seconds > 0 && change("smooth more or less", { smooth: seconds }),
        { min: 0.05, max: SMOOTHEST },
      ),
    ...notes.map(({ line }) => h("p", { class: "remark", role: "note" }, line)),
    ...fights(value.people[who]!, { track: track.id }).map((line) => h("p", { class: "remark", role: "note" }, line)),
    h(
      "div",
      { class: "pair" },
      ...(["from", "until"] as const).map((key) =>
        numberField(
          key === "from" ? "From" : "Until",
          track[key],
          "s",
          (time) => time !== null && change("stretch words of a part", { [key]: time }),
          { min: 0, max: length(value) },
        ),
      ),
    ),
    h("div", { class: "row" }, textButton("Delete", remove, { title: withKey("Delete these words", "Del") })),
  );
}

/** What a part follows: words, a clip, or with the head a point or the other person. */
function doingField(app: App, project: Project, track: Track, change: (part: Partial<Track>) => void): HTMLElement {
  const isHead = track.part === "head";
  const isPlain = !track.clip && !track.smooth;
  const isSaid = isPlain && (!isHead || track.look === null);
  const words: [string, boolean, Partial<Track>] = ["Words", isSaid, { ...PLAIN, look: null }];
  const choices: [string, boolean, Partial<Track>][] = isHead
    ? [
        words,
        [
          "Looks at a point",
          isPlain && !isSaid && track.look !== OTHER,
          { ...PLAIN, look: pointAhead(app, track.from) },
        ],
        ...(project.people.length > 1
          ? [
              ["Looks at the other person", isPlain && track.look === OTHER, { ...PLAIN, look: OTHER }] as [
                string,
                boolean,
                Partial<Track>,
              ],
            ]
          : []),
      ]
    : [words];
  const clips = [
    ...project.clips.filter((one) => one.motion !== track.clip?.motion),
    ...(track.clip ? [track.clip] : []),
  ];
  for (const clip of WORDED.includes(track.part) ? [] : clips)
    choices.push([`Clip: ${clip.name}`, clip.motion === track.clip?.motion, { clip, smooth: 0 }]);
  choices.push(["Is smoothed", track.smooth > 0, { clip: null, smooth: track.smooth || SMOOTH }]);
  const chosen = choices.findIndex(([, isChosen]) => isChosen);
  return h(
    "select",
    {
      class: "choice",
      value: String(chosen),
      "aria-label": "What it follows",
      onchange: (event: Event) => change(choices[Number((event.target as HTMLSelectElement).value)]![2]),
    },
    ...choices.map(([name], n) => h("option", { value: String(n), selected: n === chosen }, name)),
  );
}
