/** What was shown live: its frames, and the blocks that they make on the timeline. */

import { type Segment, LONGEST, round, segment } from "../project/model";
import type { LiveFrame } from "../server/live";

/** Frames that are kept, ten minutes of them; the oldest go first. */
const MOST = 12_000;
/** Words that held for less than this belong to those before them. */
const SHORT = 0.5;
const STEERED = "a person moves as steered";

export class Recording {
  private frames: LiveFrame[] = [];

  constructor(readonly fps: number) {}

  get seconds(): number {
    return this.frames.length / this.fps;
  }

  /** The number of the frame that comes next; null: any. */
  get next(): number | null {
    const last = this.frames.at(-1);
    return last ? last.frame + 1 : null;
  }

  add(frame: LiveFrame): void {
    this.frames.push(frame);
    if (this.frames.length > MOST) this.frames.shift();
  }

  /** The motion as the server takes it: `root` and `rotations`, little-endian float32 in base64. */
  file(): Blob {
    const root = base64(this.frames.flatMap((one) => [...one.root]));
    const rotations = base64(this.frames.flatMap((one) => one.rotations.flat()));
    return new Blob([JSON.stringify({ fps: this.fps, people: [{ root, rotations }] })]);
  }

  /** A block for each stretch of the same words. */
  segments(): Segment[] {
    const runs: { words: string; frames: number }[] = [];
    for (const { words } of this.frames) {
      const last = runs.at(-1);
      if (last?.words === words) last.frames += 1;
      else runs.push({ words, frames: 1 });
    }
    const blocks: { words: string; frames: number }[] = [];
    for (const run of runs) {
      if (blocks.length && run.frames < SHORT * this.fps) blocks.at(-1)!.frames += run.frames;
      else blocks.push({ ...run });
    }
    return blocks.flatMap(({ words, frames }) => pieces(words || STEERED, frames / this.fps));
  }
}

/** Blocks of at most a minute, which is the longest there is. */
function pieces(words: string, seconds: number): Segment[] {
  const count = Math.max(Math.ceil(seconds / LONGEST), 1);
  return Array.from({ length: count }, () => segment(words, Math.max(round(seconds / count), 0.2)));
}

function base64(numbers: readonly number[]): string {
  const bytes = new Uint8Array(Float32Array.from(numbers).buffer);
  let text = "";
  for (const byte of bytes) text += String.fromCharCode(byte);
  return btoa(text);
}
