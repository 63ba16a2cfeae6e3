/** Keys as text. */

/** Whether a finger presses rather than a pointer: there, no key is named. */
export const TOUCH = globalThis.matchMedia?.("(pointer: coarse)").matches ?? false;

/** A title with the key that does the same, where there are keys. */
export function withKey(title: string, key: string | undefined): string {
  return key && !TOUCH ? `${title} (${key})` : title;
}

/** A key press as text: modifiers, then the key. */
export function keyOf(event: KeyboardEvent): string {
  const key = event.key === " " ? "Space" : event.key.length === 1 ? event.key.toUpperCase() : event.key;
  const shifted = event.shiftKey && (event.key.length > 1 || /[a-z]/i.test(event.key));
  return [event.ctrlKey || event.metaKey ? "Ctrl+" : "", event.altKey ? "Alt+" : "", shifted ? "Shift+" : "", key].join(
    "",
  );
}
