/** What the viewer shows at the moment. */

import { LEFT } from "../body/skeleton";
import type { Measure } from "./curves";

export interface View {
  readonly time: number;
  readonly playing: boolean;
  readonly repeat: boolean;
  readonly rate: number;
  readonly take: number;
  readonly follow: boolean;
  readonly ghosts: boolean;
  readonly trails: boolean;
  readonly curves: boolean;
  readonly joint: number;
  readonly measure: Measure;
  readonly dark: boolean;
  readonly help: boolean;
}

export const BEGINNING: View = {
  time: 0,
  playing: false,
  repeat: true,
  rate: 1,
  take: 0,
  follow: true,
  ghosts: false,
  trails: false,
  curves: false,
  joint: LEFT.wrist,
  measure: "height",
  dark: false,
  help: false,
};

/** Speeds that one goes through. */
export const RATES = [0.1, 0.25, 0.5, 1, 2, 4] as const;
