/** The motion as one file of HTML that plays it, as `motionloom/viz/page.py` fills the viewer. */

import { POSE } from "../body/clip";
import { type Body, placesOf } from "../prior/person";
import { flat } from "../prior/prior";
import type { GivenTake } from "../viewer/data";
import type { Character } from "./character";

/** Metres: places are whole numbers of it. */
const UNIT = 0.00025;
const PLACE = '<script type="application/json" id="motion"></script>';
const TITLE = "<title>motionloom</title>";
/** Bytes that a page without a character stays under. */
export const MOST = 1.5e6;

/** The text of a page; `viewer` is the built viewer, `name` becomes its title. With a character that one plays. */
export async function shared(viewer: string, body: Body, name: string, character: Character | null): Promise<string> {
  if (!viewer.includes(PLACE) || !viewer.includes(TITLE))
    throw new Error("the viewer beside this page is of another version; load the page again");
  const places = flat(placesOf(body)).map((metres) => metres * (character?.scale ?? 1));
  const take: GivenTake = { name, fps: body.fps, people: [{ frames: body.root.length, data: await packed(places) }] };
  const file = character && (await deflated(new Uint8Array(character.glb(body, "motion 0", true))));
  const given = JSON.stringify({ takes: [take], unit: UNIT, character: file });
  const text = given.replace(/[<>&]/g, (one) => `\\u00${one.charCodeAt(0).toString(16)}`);
  const title = name.replace(/[<>&"]/g, (one) => `&#${one.charCodeAt(0)};`);
  return viewer
    .replace(PLACE, () => PLACE.replace("><", () => `>${text}<`))
    .replace(TITLE, () => `<title>${title}</title>`);
}

/** Deflated changes from frame to frame, of the root's places and of the others' from it: all low bytes come first. */
export function packed(places: Float32Array): Promise<string> {
  const frames = places.length / POSE;
  const changes = new Int32Array(places.length);
  for (let column = 0; column < POSE; column += 1) {
    let before = 0;
    for (let frame = 0; frame < frames; frame += 1) {
      const root = column < 3 ? 0 : places[frame * POSE + (column % 3)]!;
      const whole = Math.round((places[frame * POSE + column]! - root) / UNIT);
      changes[column * frames + frame] = whole - before;
      before = whole;
    }
  }
  const [bytes, planes] = [new Uint8Array(changes.buffer), new Uint8Array(changes.byteLength)];
  for (let n = 0; n < changes.length; n += 1)
    for (let plane = 0; plane < 4; plane += 1) planes[plane * changes.length + n] = bytes[4 * n + plane]!;
  return deflated(planes);
}

async function deflated(bytes: Uint8Array<ArrayBuffer>): Promise<string> {
  const stream = new Blob([bytes]).stream().pipeThrough(new CompressionStream("deflate"));
  const small = new Uint8Array(await new Response(stream).arrayBuffer());
  let text = "";
  for (let at = 0; at < small.length; at += 0x8000) text += String.fromCharCode(...small.subarray(at, at + 0x8000));
  return btoa(text);
}
