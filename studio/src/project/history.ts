/** One value with everything it ever was: undo and redo without end. */

export interface Entry<T> {
  readonly label: string;
  readonly value: T;
}

/** How a change came about, for those who listen. */
export interface Change {
  readonly label: string;
  /** A gesture is under way; the change will be followed by others, and at last by one that is no draft. */
  readonly draft: boolean;
  /** Words are being typed. */
  readonly typed: boolean;
  /** It was done on another page and is shown here; nobody did anything on this one. */
  readonly elsewhere?: boolean;
}

export interface ChangeOptions {
  /** Changes that follow each other with the same key are undone as one. */
  readonly merge?: string;
  readonly draft?: boolean;
  readonly typed?: boolean;
}

/** What another page did is one step of undo, as long as nothing is done here. */
const FOLLOWED = "another page";

export class History<T> {
  private past: Entry<T>[] = [];
  private future: Entry<T>[] = [];
  private merge = "";
  private listeners = new Set<(value: T, change: Change) => void>();

  constructor(private present: T) {}

  get value(): T {
    return this.present;
  }

  /** What undo would take back; null: nothing. */
  get undoLabel(): string | null {
    return this.past.at(-1)?.label ?? null;
  }

  get redoLabel(): string | null {
    return this.future.at(-1)?.label ?? null;
  }

  subscribe(listener: (value: T, change: Change) => void): () => void {
    this.listeners.add(listener);
    return () => this.listeners.delete(listener);
  }

  /** Make a new value that undo takes back. An edit that gives the same value back changes nothing. */
  change(label: string, edit: (value: T) => T, options: ChangeOptions = {}): void {
    const { merge = "", draft = false, typed = false } = options;
    const next = edit(this.present);
    if (next !== this.present) {
      if (!merge || merge !== this.merge) this.past.push({ label, value: this.present });
      this.merge = merge;
      this.future = [];
      this.present = next;
    } else if (draft) {
      return;
    }
    this.tell({ label, draft, typed });
  }

  /** Put something beside the point of undo, such as what was drawn, into the present value. */
  amend(edit: (value: T) => T): void {
    const next = edit(this.present);
    if (next === this.present) return;
    this.present = next;
    this.tell({ label: "", draft: false, typed: false });
  }

  /** Take over what was done on another page; undo brings back what was here, however often that page did something. */
  follow(next: T, label: string): void {
    if (this.merge !== FOLLOWED) this.past.push({ label, value: this.present });
    this.merge = FOLLOWED;
    this.future = [];
    this.present = next;
    this.tell({ label: "", draft: false, typed: false, elsewhere: true });
  }

  undo(): boolean {
    return this.move(this.past, this.future, "Undo");
  }

  redo(): boolean {
    return this.move(this.future, this.past, "Redo");
  }

  private move(from: Entry<T>[], to: Entry<T>[], word: string): boolean {
    const entry = from.pop();
    if (!entry) return false;
    to.push({ label: entry.label, value: this.present });
    this.present = entry.value;
    this.merge = "";
    this.tell({ label: `${word} ${entry.label}`, draft: false, typed: false });
    return true;
  }

  private tell(change: Change): void {
    for (const listener of this.listeners) listener(this.present, change);
  }
}
