/** Elements from values. `morph` makes what is on the page like what was just built, so that focus and carets stay. */

type Child = Node | string | null | undefined | false;
type Props = Record<string, unknown>;

const SVG = "http://www.w3.org/2000/svg";

/** An element: `on...` are handlers, `class`, `style` and attributes are attributes; false and null leave one out. */
export function h(tag: string, props: Props = {}, ...children: (Child | Child[])[]): HTMLElement {
  return fill(document.createElement(tag), props, children) as HTMLElement;
}

export function svg(tag: string, props: Props = {}, ...children: (Child | Child[])[]): SVGElement {
  return fill(document.createElementNS(SVG, tag), props, children) as SVGElement;
}

function fill(element: Element, props: Props, children: (Child | Child[])[]): Element {
  for (const [key, value] of Object.entries(props)) {
    if (value === null || value === undefined || value === false) continue;
    if (key.startsWith("on")) (element as unknown as Props)[key.toLowerCase()] = value;
    else attribute(element, key, value === true ? "" : String(value));
  }
  for (const child of children.flat()) if (child || child === "") element.append(child);
  return element;
}

/** Set an attribute; a style goes through its object, as the server's policy lets no page set one as text. */
function attribute(element: Element, name: string, value: string): void {
  if (name === "style") (element as HTMLElement).style.cssText = value;
  else element.setAttribute(name, value);
}

const HANDLERS = [
  "onclick",
  "oninput",
  "onchange",
  "onkeydown",
  "onpointerdown",
  "onfocus",
  "onblur",
  "ondragstart",
  "ondragover",
  "ondragleave",
  "ondrop",
  "onsubmit",
] as const;

/** Make the children of `root` like `children`, touching only what differs. */
export function morph(root: Element, children: readonly Node[]): void {
  const old = [...root.childNodes];
  children.forEach((child, index) => {
    const there = old[index];
    if (!there) root.append(child);
    else if (!alike(there, child)) there.replaceWith(child);
    else if (there instanceof Element) take(there, child as Element);
    else if (there.nodeValue !== child.nodeValue) there.nodeValue = child.nodeValue;
  });
  for (const extra of old.slice(children.length)) extra.remove();
}

function alike(a: Node, b: Node): boolean {
  if (a.nodeName !== b.nodeName) return false;
  return !(a instanceof Element) || a.getAttribute("data-key") === (b as Element).getAttribute("data-key");
}

/** What says by `data-same` that it is the same is left as it is: of hundreds of blocks one may have changed. */
function take(there: Element, next: Element): void {
  const same = next.getAttribute("data-same");
  if (same !== null && same === there.getAttribute("data-same")) return;
  for (const { name } of [...there.attributes]) {
    // Whether a menu is open is up to who opened it.
    const isOpen = name === "open" && there instanceof HTMLDetailsElement;
    if (!next.hasAttribute(name) && !isOpen) there.removeAttribute(name);
  }
  for (const { name, value } of next.attributes) {
    if (there.getAttribute(name) !== value) attribute(there, name, value);
  }
  const [mine, its] = [there as unknown as Props, next as unknown as Props];
  for (const name of HANDLERS) if (mine[name] !== its[name]) mine[name] = its[name];
  morph(there, [...next.childNodes]);
  if (there instanceof HTMLInputElement || there instanceof HTMLTextAreaElement || there instanceof HTMLSelectElement) {
    takeValue(there, next as HTMLInputElement);
  }
}

function takeValue(there: HTMLInputElement | HTMLTextAreaElement | HTMLSelectElement, next: HTMLInputElement): void {
  const value = next.getAttribute("value") ?? next.value;
  // What somebody types is not taken out of their hands; it is put right when they leave.
  const typing = document.activeElement === there && there instanceof HTMLInputElement && there.type === "number";
  if (there.value !== value && !typing) there.value = value;
  if (there instanceof HTMLInputElement) there.checked = next.hasAttribute("checked");
}
