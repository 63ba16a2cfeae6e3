/** What the page and its worker say to each other. */

import type { Body } from "../prior/person";
import type { Place } from "../prior/path";
import type { Segment } from "../prior/prior";

export interface Draw {
  readonly id: number;
  readonly segments: readonly Segment[];
  /** Whether numbers in the words are left to the network. */
  readonly literal: boolean;
  readonly seed: number;
  readonly takes: number;
  /** On the ground; fewer than two points: none. */
  readonly path: readonly Place[];
}

/** Give up what is being drawn. */
export interface Stop {
  readonly stop: number;
}

export interface About {
  readonly weights: string;
  readonly name: string;
  readonly licence: string;
  readonly data: string;
}

export type WorkerMessage =
  | { readonly kind: "loading"; readonly done: number; readonly of: number }
  | {
      readonly kind: "ready";
      readonly about: About;
      readonly threads: number;
      /** Whether the graphics processor draws. */
      readonly graphics: boolean;
      /** Why it does not though there is one; empty: nothing to say. */
      readonly remark: string;
    }
  | {
      readonly kind: "sketch";
      readonly id: number;
      readonly done: number;
      readonly of: number;
      /** Places of each take as they are guessed so far; none early on. */
      readonly takes: readonly Float32Array[];
    }
  | {
      readonly kind: "drawn";
      readonly id: number;
      readonly bodies: readonly Body[];
      readonly takes: readonly Float32Array[];
      /** For each take a sentence for each number in the words that it misses. */
      readonly misses: readonly (readonly string[])[];
    }
  /** id null: nothing can be drawn at all. */
  | { readonly kind: "failed"; readonly id: number | null; readonly message: string };
