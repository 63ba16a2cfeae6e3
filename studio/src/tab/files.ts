/** Files that come to the page, and that leave it. */

import { h } from "../app/dom";

/** Call back with files that are dropped anywhere on the page. */
export function onDrop(dropped: (file: File) => void): void {
  addEventListener("dragover", (event) => event.preventDefault());
  addEventListener("drop", (event) => {
    event.preventDefault();
    const file = event.dataTransfer?.files[0];
    if (file) dropped(file);
  });
}

/** Let somebody choose a file. */
export function chosenFile(accept: string, chosen: (file: File) => void): void {
  const field = h("input", { type: "file", accept }) as HTMLInputElement;
  field.onchange = () => field.files?.[0] && chosen(field.files[0]);
  field.click();
}

export function saved(name: string, content: string | ArrayBuffer): void {
  const address = URL.createObjectURL(new Blob([content]));
  (h("a", { href: address, download: name }) as HTMLAnchorElement).click();
  setTimeout(() => URL.revokeObjectURL(address), 60_000);
}
