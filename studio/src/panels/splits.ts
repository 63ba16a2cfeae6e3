/** Edges between the parts of the page, dragged by pointer or moved by arrow keys; this browser keeps where they are. */

import { clamp } from "../project/model";

const KEY = "motionloom-sizes";

/** Pixels that an arrow key moves an edge by. */
const STEP = 16;

interface Split {
  readonly id: string;
  readonly label: string;
  readonly variable: string;
  readonly isUpright: boolean;
  readonly usual: number;
  readonly least: number;
  readonly most: () => number;
}

const SPLITS: readonly Split[] = [
  {
    id: "split-inspector",
    label: "Width of the panel",
    variable: "--inspector",
    isUpright: true,
    usual: 292,
    least: 220,
    most: () => innerWidth * 0.5,
  },
  {
    id: "split-timeline",
    label: "Height of the timeline",
    variable: "--timeline",
    isUpright: false,
    usual: 276,
    least: 150,
    most: () => innerHeight * 0.7,
  },
];

export function splits(): void {
  const sizes = JSON.parse(localStorage.getItem(KEY) ?? "{}") as Record<string, number>;
  for (const one of SPLITS) split(one, sizes);
}

function split(one: Split, sizes: Record<string, number>): void {
  const edge = document.getElementById(one.id)!;
  const set = (size: number, isKept = true) => {
    const now = Math.round(clamp(size, one.least, one.most()));
    document.body.style.setProperty(one.variable, `${now}px`);
    edge.setAttribute("aria-valuenow", String(now));
    edge.setAttribute("aria-valuemax", String(Math.round(one.most())));
    if (!isKept) return;
    sizes[one.id] = now;
    localStorage.setItem(KEY, JSON.stringify(sizes));
  };
  const now = () => Number(edge.getAttribute("aria-valuenow"));
  const attributes = {
    role: "separator",
    tabindex: "0",
    title: `${one.label}: drag, or arrow keys; double-click for the usual one`,
    "aria-label": one.label,
    "aria-orientation": one.isUpright ? "vertical" : "horizontal",
    "aria-valuemin": String(one.least),
  };
  for (const [name, value] of Object.entries(attributes)) edge.setAttribute(name, value);
  set(sizes[one.id] ?? one.usual, false);
  let from: { size: number; at: number } | null = null;
  const along = (event: PointerEvent) => (one.isUpright ? event.clientX : event.clientY);
  edge.addEventListener("pointerdown", (event) => {
    edge.setPointerCapture(event.pointerId);
    from = { size: now(), at: along(event) };
  });
  edge.addEventListener("pointermove", (event) => from && set(from.size + from.at - along(event)));
  edge.addEventListener("lostpointercapture", () => (from = null));
  edge.addEventListener("dblclick", () => set(one.usual));
  edge.addEventListener("keydown", (event) => {
    const [more, less] = one.isUpright ? ["ArrowLeft", "ArrowRight"] : ["ArrowUp", "ArrowDown"];
    const by = event.key === more ? STEP : event.key === less ? -STEP : 0;
    if (!by) return;
    event.preventDefault();
    event.stopPropagation();
    set(now() + by);
  });
}
