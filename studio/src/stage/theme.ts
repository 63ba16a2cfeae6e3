/** Colours of the stage, dark and light. */

export interface FigureLook {
  readonly body: string;
  readonly joints: string;
  readonly opacity: number;
}

export interface StageTheme {
  readonly background: string;
  readonly line: string;
  readonly strong: string;
  readonly label: string;
  readonly steps: string;
  readonly shadow: number;
  readonly sky: string;
  readonly ground: string;
  readonly sun: number;
  readonly fill: number;
  readonly people: readonly [FigureLook, FigureLook];
  readonly path: readonly [string, string];
  readonly unmet: string;
  readonly met: string;
}

export const LIGHT: StageTheme = {
  background: "#e9e7e2",
  line: "#cfccc4",
  strong: "#b3afa5",
  label: "#7c786e",
  steps: "#b3afa5",
  shadow: 0.26,
  sky: "#ffffff",
  ground: "#c9c2b4",
  sun: 1.6,
  fill: 1.6,
  people: [
    { body: "#ead9bd", joints: "#d2b995", opacity: 1 },
    { body: "#b4c6d4", joints: "#94acbf", opacity: 1 },
  ],
  path: ["#c2571a", "#2c6e9b"],
  unmet: "#cc2b2b",
  met: "#2e8b57",
};

export const DARK: StageTheme = {
  background: "#1b1d21",
  line: "#2c2f35",
  strong: "#3f434b",
  label: "#868c97",
  steps: "#7b818c",
  shadow: 0.5,
  sky: "#cfd8e6",
  ground: "#35322e",
  sun: 1.5,
  fill: 1.1,
  people: [
    { body: "#dcc8a6", joints: "#bfa27a", opacity: 1 },
    { body: "#94abbd", joints: "#7690a5", opacity: 1 },
  ],
  path: ["#f08a4b", "#5fb0e0"],
  unmet: "#ff6459",
  met: "#5ccb8b",
};

/** Futures and other takes, each in a colour of its own. */
export const GHOSTS = ["#3f8fd2", "#4fa36a", "#a86fc9", "#c9a227", "#d0587e", "#2fb0b8", "#7d8793", "#5a5fd0"] as const;
