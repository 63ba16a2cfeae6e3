/** Events in single blocks, as the server measures them, requested when they are shown. */

import { type Segment, begins, keptTake } from "../project/model";
import { isUpToDate } from "../project/plan";
import { deeds } from "../server/api";
import type { App } from "./app";

/** Sentences of the motion in a block, one for each person; none where the motion is not of these blocks yet. */
export async function eventsInBlock(app: App, one: Segment): Promise<readonly string[]> {
  const { value } = app.project;
  const take = keptTake(value);
  const index = value.segments.findIndex((other) => other.id === one.id);
  if (!take || index < 0 || !isUpToDate(value)) return [];
  const at = begins(value.segments);
  const end = Math.min(at[index + 1]!, take.seconds);
  if (end - at[index]! < 0.25) return [];
  return deeds(take.motion, at[index]!, end).catch(() => []);
}
