/**
 * `<motionloom-viewer src="walk.glb">`: plays the animations of a glTF file.
 *
 * Attributes: `src`, a .glb or .vrm that this page may fetch; `theme`, "dark" or "light" (without it as the browser
 * is); `paused`, which keeps it from playing by itself. Events: `load` when it is shown, `error` with `message`.
 */

import { h } from "../../../src/app/dom";
import { parseGltf } from "../../../src/stage/actor";
import buttons from "../../../src/style/buttons.css?inline";
import colors from "../../../src/style/colors.css?inline";
import { takesOfFile } from "../../../src/viewer/data";
import { Viewer } from "../../../src/viewer/viewer";
import style from "../../../src/viewer/viewer.css?inline";

const OWN = ":host { display: block; height: 420px; } :host([hidden]) { display: none; }";

export class MotionloomViewer extends HTMLElement {
  static readonly observedAttributes = ["src", "theme"];
  private readonly root = h("div", { class: "viewer" });
  private viewer: Viewer | null = null;
  /** Of the file that is asked for now; what arrives of others is too late. */
  private asked: AbortController | null = null;

  constructor() {
    super();
    const shadow = this.attachShadow({ mode: "open" });
    const sheet = new CSSStyleSheet();
    sheet.replaceSync([OWN, colors, buttons, style].join("\n"));
    shadow.adoptedStyleSheets = [sheet];
    shadow.append(this.root);
  }

  /** Seconds into the animation. */
  get currentTime(): number {
    return this.viewer?.view.value.time ?? 0;
  }

  set currentTime(seconds: number) {
    this.viewer?.go(seconds);
  }

  /** Seconds of the animation; 0 until it is there. */
  get duration(): number {
    return this.viewer?.seconds ?? 0;
  }

  play(): void {
    this.viewer?.view.update({ playing: true });
  }

  pause(): void {
    this.viewer?.view.update({ playing: false });
  }

  connectedCallback(): void {
    void this.show();
  }

  disconnectedCallback(): void {
    this.leave();
  }

  attributeChangedCallback(name: string, before: string | null, now: string | null): void {
    if (!this.isConnected || before === now) return;
    if (name === "src") void this.show();
    else this.viewer?.view.update({ dark: this.isDark });
  }

  private get isDark(): boolean {
    const theme = this.getAttribute("theme");
    return theme ? theme === "dark" : matchMedia("(prefers-color-scheme: dark)").matches;
  }

  private leave(): void {
    this.asked?.abort();
    this.asked = null;
    this.viewer?.dispose();
    this.viewer = null;
  }

  private async show(): Promise<void> {
    this.leave();
    const src = this.getAttribute("src");
    if (!src) return;
    const { signal } = (this.asked = new AbortController());
    try {
      const answer = await fetch(new URL(src, document.baseURI), { signal });
      if (!answer.ok) throw new Error(`${src} is answered with ${answer.status}`);
      const takes = takesOfFile(await parseGltf(await answer.arrayBuffer()));
      if (signal.aborted) return;
      if (takes.length === 0) throw new Error(`${src} has no animation`);
      const isCalm = this.hasAttribute("paused") || matchMedia("(prefers-reduced-motion: reduce)").matches;
      this.viewer = new Viewer(this.root, takes, { dark: this.isDark, playing: !isCalm, keys: this, notices: "" });
      this.dispatchEvent(new Event("load"));
    } catch (error) {
      if (signal.aborted) return;
      const { message } = error as Error;
      this.root.replaceChildren(h("p", { class: "problem", role: "alert" }, `This motion cannot be shown: ${message}`));
      this.dispatchEvent(new ErrorEvent("error", { message }));
    }
  }
}

if (!customElements.get("motionloom-viewer")) customElements.define("motionloom-viewer", MotionloomViewer);
