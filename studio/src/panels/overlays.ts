/** What lies over the stage: sentences about what went wrong, names of takes, what a key does, dropped files. */

import { type Actions } from "../app/actions";
import { type App, seenTakes, shownClip } from "../app/app";
import { h, morph } from "../app/dom";
import type { Files } from "../app/files";
import { GHOSTS } from "../stage/theme";
import { dialog } from "./dialog";
import { icon } from "./icons";
import { shownKey } from "./parts";

type Choice = "copy" | "theirs" | "mine";

/** `settle`: what is to become of changes that meet somebody else's. */
export function notices(app: App, retry: () => void, settle: (choice: Choice) => void, root: HTMLElement): void {
  const render = () => {
    const { error, connected, drawing, person, conflict, told } = app.session.value;
    const isElsewhere = !error?.at || (error.at.kind !== "segment" && error.at.who !== person);
    const waiting = !shownClip(app) && drawing;
    morph(root, [
      ...(connected
        ? []
        : [
            h(
              "p",
              { class: "notice away", role: "alert" },
              "The server does not answer. Your work is kept in this browser and goes on as soon as the server is back.",
            ),
          ]),
      ...(conflict ? [question(app, settle)] : []),
      ...(told
        ? [
            h(
              "p",
              { class: "notice told", role: told.endsWith("…") ? "status" : "alert" },
              h("span", {}, told),
              h(
                "button",
                { class: "cross", "aria-label": "Close", onclick: () => app.session.update({ told: null }) },
                "×",
              ),
            ),
          ]
        : []),
      // What belongs to a block, a path or a target is said there.
      ...(error && isElsewhere
        ? [
            h(
              "p",
              { class: "notice", role: "alert" },
              h("span", {}, error.message),
              h("button", { class: "text", onclick: retry }, "Try again"),
              h(
                "button",
                { class: "cross", "aria-label": "Close", onclick: () => app.session.update({ error: null }) },
                "×",
              ),
            ),
          ]
        : []),
      ...(waiting && !error ? [h("p", { class: "notice calm" }, "Drawing the first motion …")] : []),
    ]);
  };
  app.session.subscribe((now, before) => {
    if (
      now.error !== before.error ||
      now.person !== before.person ||
      now.conflict !== before.conflict ||
      now.told !== before.told ||
      now.connected !== before.connected ||
      !now.drawing !== !before.drawing ||
      now.clips !== before.clips
    )
      render();
  });
  render();
}

/** What is asked where the server has something else than what was changed here. */
function question(app: App, settle: (choice: Choice) => void): HTMLElement {
  const { conflict, stamp } = app.session.value;
  const theirs = conflict!.project?.name;
  const [sentence, load, over] = !conflict!.stamp
    ? ["This browser has changes that no server has, and the project folder is empty.", "Begin anew", "Go on with mine"]
    : conflict!.stamp.id !== stamp.id
      ? [
          `The server has another project now${theirs ? `, “${theirs}”` : ""}. Your changes are not saved.`,
          "Load the other",
          "Overwrite it with mine",
        ]
      : [
          "Somebody has saved this project on another page meanwhile. Your changes are not saved.",
          "Load the other",
          "Overwrite it with mine",
        ];
  return h(
    "div",
    { class: "notice conflict", role: "alertdialog", "aria-label": "Your changes are not saved" },
    h("span", {}, sentence),
    h("button", { class: "text", onclick: () => settle("copy") }, "Keep mine as a copy"),
    h("button", { class: "text", onclick: () => settle("theirs") }, load),
    h("button", { class: "text", onclick: () => settle("mine") }, over),
  );
}

/** The number of each take on its part of the picture. */
export function takeNames(app: App, root: HTMLElement): void {
  const render = () => {
    const { sideBySide, fan } = app.session.value;
    const clips = seenTakes(app);
    root.hidden = !sideBySide || fan !== null;
    const columns = clips.length > 1 ? 2 : 1;
    root.style.gridTemplateColumns = `repeat(${columns}, 1fr)`;
    morph(
      root,
      clips.map((_, index) =>
        h(
          "span",
          { class: index === app.project.value.kept ? "chosen" : "" },
          h("i", { style: `background:${GHOSTS[index % GHOSTS.length]}` }),
          `Take ${index + 1}${index === app.project.value.kept ? " · kept" : ""}`,
        ),
      ),
    );
  };
  app.project.subscribe(render);
  app.denoising.subscribe((now, before) => {
    if (now.length !== before.length) render();
  });
  app.session.subscribe((now, before) => {
    if (now.sideBySide !== before.sideBySide || now.clips !== before.clips || now.fan !== before.fan) render();
  });
  render();
}

/** The actions whose keys matter most. */
const EIGHT = ["play", "write", "add", "path", "target", "four", "undo", "palette"] as const;

export function help(app: App, actions: Actions): void {
  const all = Object.values(actions).filter((one) => one.keys.length);
  const groups = [...new Set(all.map((action) => action.group))];
  const rows = (group: string) =>
    all
      .filter((one) => one.group === group)
      .flatMap((one) => [
        h("dt", {}, ...one.keys.slice(0, 2).map((key) => h("kbd", {}, shownKey(key)))),
        h("dd", {}, one.label),
      ]);
  const search = h("input", {
    class: "search",
    type: "search",
    placeholder: "Find a key",
    "aria-label": "Find a key",
  }) as HTMLInputElement;
  const eight = h(
    "p",
    { class: "eight" },
    ...EIGHT.map((name) => h("span", {}, h("kbd", {}, shownKey(actions[name]!.keys[0]!)), ` ${actions[name]!.label}`)),
  );
  search.oninput = () => {
    const asked = search.value.trim().toLowerCase();
    eight.hidden = asked !== "";
    for (const part of document.querySelectorAll<HTMLElement>("#help .groups section")) {
      const found = [...part.querySelectorAll<HTMLElement>("dd")].map((name) => {
        const key = name.previousElementSibling as HTMLElement;
        const isAsked = `${name.textContent} ${key.textContent}`.toLowerCase().includes(asked);
        [name.hidden, key.hidden] = [!isAsked, !isAsked];
        return isAsked;
      });
      part.hidden = asked !== "" && !found.some(Boolean);
    }
  };
  dialog(app, "help", "Keys", () => [
    search,
    eight,
    h(
      "div",
      { class: "groups" },
      ...groups.map((group) => h("section", {}, h("h3", {}, group), h("dl", {}, ...rows(group)))),
      h(
        "section",
        {},
        h("h3", {}, "Besides"),
        h(
          "p",
          { class: "quiet" },
          "With the path or joint tool the arrow keys move the cursor or the joint (Shift: finer), Page Up and Page Down its height, Enter puts a point. 1 to 9 keep a take or choose a future. Alt while dragging does not snap, Shift changes between pushing aside and lying over. Ctrl and the wheel zoom the timeline at the pointer.",
        ),
      ),
      h(
        "section",
        {},
        h("h3", {}, "About"),
        h(
          "p",
          { class: "quiet" },
          "motionloom is free under the MIT licence. The page contains the work of others: ",
          h("a", { href: "third-party-notices.txt", target: "_blank", rel: "noopener" }, "third-party notices"),
          ".",
        ),
      ),
    ),
  ]);
}

/** Files dropped anywhere, or chosen in a dialog; gives what opens that dialog. */
export function drops(files: Files, root: HTMLElement): () => void {
  const input = h("input", {
    type: "file",
    multiple: true,
    hidden: true,
    "aria-label": "Open files",
    accept: ".bvh,.amc,.asf,.glb,.vrm,.npz,.json,.yaml,.yml",
  }) as HTMLInputElement;
  input.addEventListener("change", () => {
    void files.open([...(input.files ?? [])]);
    input.value = "";
  });
  const veil = h(
    "div",
    { class: "veil", hidden: true },
    h("p", {}, icon("download"), "Drop motions, characters, timelines or a project"),
  );
  root.append(input, veil);
  const isFiles = (event: DragEvent) => event.dataTransfer?.types.includes("Files") ?? false;
  root.addEventListener("dragover", (event) => {
    if (!isFiles(event)) return;
    event.preventDefault();
    veil.hidden = false;
  });
  root.addEventListener("dragleave", (event) => {
    if (!event.relatedTarget) veil.hidden = true;
  });
  root.addEventListener("drop", (event) => {
    veil.hidden = true;
    if (!isFiles(event)) return;
    event.preventDefault();
    void files.open([...(event.dataTransfer?.files ?? [])]);
  });
  return () => input.click();
}
