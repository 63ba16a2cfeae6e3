/** Sentences as motions, with the numbers in their words kept: counted steps are made again until they are as many. */

import type { GroundPose } from "./features";
import { rowSeed } from "./noise";
import { type Place, startOf } from "./path";
import { type Body, placesOf } from "./person";
import type { Prior, Segment, Watcher } from "./prior";
import { rounded } from "./turns";
import { measured, missed, nextShare, partsOf, reading } from "./amounts";

/** Tries of a motion whose steps are not as many as the words say. */
const TRIES = 6;

export interface Wish {
  readonly segments: readonly Segment[];
  /** Numbers in the words are left to the network. */
  readonly literal: boolean;
  readonly seed: number;
  readonly takes: number;
  /** Points on the ground, metres; fewer than two: none. Numbers of ways and turns give way to it. */
  readonly path: readonly Place[];
  /** Seconds of the longest sentence. */
  readonly longest: number;
}

/** One take. */
export interface Take {
  readonly features: Float32Array;
  readonly body: Body;
  readonly places: ReturnType<typeof placesOf>;
  /** A sentence for each number that the motion does not keep. */
  readonly misses: string[];
}

/** As `Watcher`; `begin`: where the person begins who follows a path. */
export type Viewer = (...seen: [...Parameters<Watcher>, begin: GroundPose | undefined]) => Promise<void>;

/** Takes of a wish; one take is the best of `TRIES` where steps are counted. `watch`: of the try under way. */
export async function spoken(prior: Prior, wish: Wish, watch?: Viewer): Promise<Take[]> {
  const { segments, seed, takes, path } = wish;
  const { fps } = prior;
  const read = segments.map(({ text }) => (wish.literal ? null : reading(text, fps, wish.longest).amount));
  let shares = segments.map(() => 1);
  let best: { off: number; found: Take[] } | null = null;
  for (let number = 0; number < TRIES; number += 1) {
    const each = segments.map(({ text, seconds }, n) => partsOf(text, seconds, read[n]!, fps, shares[n]));
    const parts = each.flat();
    const way = path.length > 1 ? prior.way(parts, path) : null;
    const begin = way ? startOf(way) : undefined;
    const seen: Watcher | undefined = watch && ((done, of, clean) => watch(done, of, clean, begin));
    const made = await prior.features(parts, number ? rowSeed(seed, number) : seed, takes, seen, way);
    const sizes: (number | null)[][] = [];
    const found = made.map((features): Take => {
      const body = prior.person(features, parts, way);
      const places = placesOf(body);
      let at = 0;
      const own = each.map((some, n) => {
        const begin = at;
        at += some.reduce((frames, { seconds }) => frames + rounded(seconds * fps), 0);
        return read[n] && !way ? measured(read[n], places.slice(begin, at), fps) : null;
      });
      sizes.push(own);
      const misses = own.flatMap((size, n) => (size !== null && missed(read[n]!, size)) || []);
      return { features, body, places, misses };
    });
    const own = sizes[0]!;
    const off = read.reduce(
      (sum, one, n) => sum + (one?.kind === "steps" ? Math.abs(one.size - (own[n] ?? one.size)) : 0),
      0,
    );
    if (!best || off < best.off) best = { off, found };
    if (!off || takes > 1) break;
    shares = shares.map((share, n) => (own[n] === null ? share : nextShare(share, read[n]!.size, own[n]!)));
  }
  return best!.found;
}
