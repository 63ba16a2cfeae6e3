/** Asks which joint of a character is which, where the server could not tell: its own joints at the left, the body's 22
 * at the right, what is guessed filled in. */

import type { App } from "../app/app";
import { h, morph } from "../app/dom";
import type { Files } from "../app/files";
import type { Unnamed } from "../app/session";
import { JOINTS, jointName } from "../body/skeleton";
import { dialog } from "./dialog";

/** Without these nobody can move; the others are found from them. */
const NEEDED = ["hip", "knee", "ankle", "shoulder", "elbow", "wrist"];
/** Joints that are needed, left and right. */
const LEAST = 2 * NEEDED.length;
/** Pixels of the picture, and within which a joint is hit. */
const [WIDTH, HEIGHT, REACH] = [340, 430, 14];
/** Degrees that the picture turns by in a second. */
const TURNING = 28;

type Chosen = Record<string, string>;

export function jointDialog(app: App, files: Files): void {
  let chosen: Chosen = {};
  let part: string = JOINTS[0];
  const message = h("p", { class: "unmet", role: "alert" });
  const rows = h("div", { class: "parts" });
  const picture = new Picture((joint) => choose(part, joint));
  const unnamed = () => app.session.value.unnamed;
  const choose = (name: string, joint: string) => {
    if (joint) chosen[name] = joint;
    else delete chosen[name];
    render();
  };
  const look = (name: string) => {
    part = name;
    picture.show(unnamed(), chosen, part);
    for (const row of rows.children) row.classList.toggle("chosen", row.getAttribute("data-key") === name);
  };
  const render = () => {
    const names = unnamed()?.joints.map((one) => one.name) ?? [];
    morph(
      rows,
      JOINTS.map((name) => partRow(name, names, chosen[name] ?? "", name === part, choose, look)),
    );
    picture.show(unnamed(), chosen, part);
  };
  const send = async () => {
    message.textContent = (await files.nameJoints({ ...chosen })) ?? "";
    if (message.textContent) message.scrollIntoView({ block: "nearest" });
  };
  dialog(app, "joints", "Which joint is which?", () => {
    const asked = unnamed()!;
    chosen = { ...asked.guesses };
    part = JOINTS.find((name) => isNeeded(name) && !chosen[name]) ?? JOINTS[0];
    message.textContent = "";
    render();
    return [
      h(
        "p",
        { class: "quiet" },
        `${asked.file.name}: its joints have names or an order that say too little. Choose a part at the right, and its joint there or in the picture; what stays free is found from the others.`,
      ),
      h("div", { class: "naming" }, picture.element, rows),
      h("p", { class: "unmet", hidden: asked.joints.length >= LEAST }, tooFew(asked.joints.length)),
      message,
      h(
        "div",
        { class: "row end" },
        h("button", { class: "text strong", onclick: () => void send() }, "Use these joints"),
      ),
    ];
  });
}

function tooFew(count: number): string {
  return `It has ${count} joints, and hips, knees, ankles, shoulders, elbows and wrists are needed: give it more where it comes from.`;
}

function isNeeded(name: string): boolean {
  return NEEDED.some((one) => name.endsWith(one));
}

function partRow(
  name: string,
  names: readonly string[],
  value: string,
  isChosen: boolean,
  choose: (name: string, joint: string) => void,
  look: (name: string) => void,
): HTMLElement {
  const isMissing = !value && isNeeded(name);
  return h(
    "label",
    {
      class: `part${isChosen ? " chosen" : ""}${isMissing ? " missing" : ""}`,
      "data-key": name,
      onclick: () => look(name),
    },
    h("span", {}, jointName(JOINTS.indexOf(name as (typeof JOINTS)[number]))),
    h(
      "select",
      {
        value,
        "aria-invalid": isMissing ? "true" : null,
        onfocus: () => look(name),
        onchange: (event: Event) => choose(name, (event.target as HTMLSelectElement).value),
      },
      h("option", { value: "" }, isNeeded(name) ? "choose" : "by itself"),
      ...names.map((one) => h("option", { value: one, selected: one === value }, one)),
    ),
  );
}

/** The skeleton as it stands at rest, turning; a press on a joint chooses it. */
class Picture {
  readonly element: HTMLElement;
  private readonly canvas = h("canvas", {
    width: String(WIDTH * 2),
    height: String(HEIGHT * 2),
    role: "img",
    "aria-label": "The character's joints",
  }) as HTMLCanvasElement;
  private readonly turn = h("input", {
    type: "range",
    min: "0",
    max: "360",
    value: "25",
    "aria-label": "Turn the picture",
  }) as HTMLInputElement;
  private readonly name = h("output", { class: "quiet", "aria-label": "The joint under the pointer" });
  private asked: Unnamed | null = null;
  private chosen: Chosen = {};
  private part = "";
  private over = "";
  private held = matchMedia("(prefers-reduced-motion: reduce)").matches;
  private last = 0;
  private yaw = 25;

  constructor(choose: (joint: string) => void) {
    this.element = h("div", { class: "picture" }, this.canvas, this.turn, this.name);
    this.turn.addEventListener("input", () => this.hold(Number(this.turn.value)));
    this.canvas.addEventListener("pointermove", (event) => {
      this.over = this.under(event);
      this.name.textContent = this.over || " ";
      if (event.buttons) this.hold((this.yaw + event.movementX + 360) % 360);
    });
    this.canvas.addEventListener("click", (event) => this.under(event) && choose(this.under(event)));
  }

  private hold(yaw: number): void {
    this.held = true;
    this.yaw = yaw;
  }

  show(asked: Unnamed | null, chosen: Chosen, part: string): void {
    const isNew = asked !== this.asked;
    [this.asked, this.chosen, this.part] = [asked, chosen, part];
    if (isNew && asked) requestAnimationFrame((now) => this.step(now));
  }

  private step(now: number): void {
    if (!this.asked || (this.last && !this.canvas.isConnected)) return void (this.last = 0);
    if (this.last && !this.held) this.yaw = (this.yaw + ((now - this.last) / 1000) * TURNING) % 360;
    this.last = now;
    this.turn.value = String(Math.round(this.yaw));
    this.draw();
    requestAnimationFrame((next) => this.step(next));
  }

  /** Places of the joints on the canvas, in its CSS pixels. */
  private places(): [number, number][] {
    const places = this.asked!.joints.map((one) => one.place);
    const [low, high] = [0, 1, 2].reduce(
      ([a, b], axis) => [
        [...a, Math.min(...places.map((one) => one[axis]!))],
        [...b, Math.max(...places.map((one) => one[axis]!))],
      ],
      [[] as number[], [] as number[]],
    );
    const middle = low.map((one, axis) => (one + high[axis]!) / 2);
    const wide = Math.hypot(high[0]! - low[0]!, high[2]! - low[2]!) || 1;
    const scale = Math.min((HEIGHT - 40) / (high[1]! - low[1]! || 1), (WIDTH - 40) / wide);
    const yaw = (this.yaw * Math.PI) / 180;
    return places.map(([x, y, z]) => {
      const [a, b] = [x - middle[0]!, z - middle[2]!];
      return [WIDTH / 2 + (a * Math.cos(yaw) - b * Math.sin(yaw)) * scale, HEIGHT / 2 - (y - middle[1]!) * scale];
    });
  }

  private under(event: MouseEvent): string {
    if (!this.asked) return "";
    const box = this.canvas.getBoundingClientRect();
    const [px, py] = [
      ((event.clientX - box.left) / box.width) * WIDTH,
      ((event.clientY - box.top) / box.height) * HEIGHT,
    ];
    let [best, nearest] = ["", REACH];
    this.places().forEach(([x, y], index) => {
      const apart = Math.hypot(x - px, y - py);
      if (apart < nearest) [best, nearest] = [this.asked!.joints[index]!.name, apart];
    });
    return best;
  }

  private draw(): void {
    const context = this.canvas.getContext("2d")!;
    const style = getComputedStyle(document.documentElement);
    const color = (name: string) => style.getPropertyValue(`--${name}`).trim();
    const places = this.places();
    context.setTransform(2, 0, 0, 2, 0, 0);
    context.clearRect(0, 0, WIDTH, HEIGHT);
    context.strokeStyle = color("quiet");
    context.lineWidth = 1.5;
    this.asked!.joints.forEach(({ parent }, index) => {
      if (parent < 0) return;
      context.beginPath();
      context.moveTo(...places[parent]!);
      context.lineTo(...places[index]!);
      context.stroke();
    });
    const taken = new Set(Object.values(this.chosen));
    this.asked!.joints.forEach(({ name }, index) => {
      const isNow = name === this.chosen[this.part];
      context.fillStyle = isNow ? color("accent") : taken.has(name) ? color("good") : color("quiet");
      context.beginPath();
      context.arc(...places[index]!, isNow ? 8 : name === this.over ? 6 : 4, 0, 2 * Math.PI);
      context.fill();
    });
  }
}
