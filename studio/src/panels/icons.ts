/** Small pictures for buttons, drawn on 20 by 20. */

import { svg } from "../app/dom";

const PATHS = {
  select: "M5 3l10 7-4.5 1L13 16l-2 1-2.5-5L5 15z",
  path: "M4 16c0-5 12-3 12-8M4 16a1.4 1.4 0 1 0 .01 0M16 5.5a1.4 1.4 0 1 0 .01 0",
  target: "M10 3v4M10 13v4M3 10h4M13 10h4M10 8.6a1.4 1.4 0 1 0 .01 0",
  pose: "M10 3.2a1.8 1.8 0 1 0 .01 0M10 7v5M5 8.5l5 .5 5-.5M10 12l-3 5M10 12l3 5",
  follow: "M3 6h9v8H3zM12 9l5-2.5v7L12 11z",
  above: "M10 3v9M6.5 8.5L10 12l3.5-3.5M4 16h12",
  ghosts: "M8 4.2a1.7 1.7 0 1 0 .01 0M8 8v8M12.5 4.2a1.7 1.7 0 1 1-.01 0M12.5 8v8",
  trails: "M3 14c3-8 5 2 7-3s4-6 7-5",
  play: "M6 4l10 6-10 6z",
  pause: "M6 4h3v12H6zM11 4h3v12h-3z",
  undo: "M7 5L3.5 8.5 7 12M4 8.5h7a4 4 0 0 1 0 8H8",
  redo: "M13 5l3.5 3.5L13 12M16 8.5H9a4 4 0 0 0 0 8h3",
  theme: "M10 3a7 7 0 1 0 0 14zM10 3a7 7 0 0 1 0 14",
  repeat: "M4 9a4 4 0 0 1 4-4h8M13 2l3 3-3 3M16 11a4 4 0 0 1-4 4H4M7 18l-3-3 3-3",
  split: "M10 3v14M3 7h4v6H3M17 7h-4v6h4",
  duplicate: "M4 4h8v8H4zM8 12v4h8V8h-4",
  remove: "M5 6h10M8 6V4h4v2M6.5 6l.7 10h5.6l.7-10",
  add: "M10 4v12M4 10h12",
  freeze: "M10 3v14M4 6.5l12 7M16 6.5l-12 7",
  draw: "M15.5 7A6 6 0 1 0 16 11M16 3v4h-4",
  grid: "M3 3h6v6H3zM11 3h6v6h-6zM3 11h6v6H3zM11 11h6v6h-6z",
  next: "M3 10h6M9 10l7-5M9 10h8M9 10l7 5",
  live: "M10 6.5a3.5 3.5 0 1 0 .01 0M4.5 4.5a7.8 7.8 0 0 0 0 11M15.5 4.5a7.8 7.8 0 0 1 0 11",
  help: "M7 7.5a3 3 0 1 1 4.2 2.7c-.9.4-1.2 1-1.2 2M10 15.3v.2",
  around: "M3 10c0-2 3-3.5 7-3.5S17 8 17 10s-3 3.5-7 3.5M12.5 11L10 13.5l2.5 2.5M10 3v1",
  front: "M10 2.7a1.7 1.7 0 1 0 .01 0M6 8h8M10 8v5M10 13l-2.5 5M10 13l2.5 5",
  side: "M9 2.7a1.7 1.7 0 1 0 .01 0M9 7v6l-1 5h2.5M9 8l2 4M11 4.5h2",
  curves: "M3 3v14h14M5 13c3 0 3-7 6-7s2 5 5 5",
  search: "M8.5 3.5a5 5 0 1 0 .01 0M12.2 12.2L17 17",
  panel: "M3 4h14v12H3zM12.5 4v12",
  download: "M10 3v9M6.5 8.5L10 12l3.5-3.5M4 16h12",
} as const;

export type Icon = keyof typeof PATHS;

export function icon(name: Icon): SVGElement {
  const solid = name === "play" || name === "pause";
  return svg(
    "svg",
    {
      viewBox: "0 0 20 20",
      width: 18,
      height: 18,
      "aria-hidden": "true",
      fill: solid ? "currentColor" : "none",
      stroke: solid ? "none" : "currentColor",
      "stroke-width": 1.5,
      "stroke-linecap": "round",
      "stroke-linejoin": "round",
    },
    svg("path", { d: PATHS[name] }),
  );
}
