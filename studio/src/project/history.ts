/** One value with everything it ever was: undo and redo without end. */

export interface Entry<T> {
  readonly label: string;
  readonly value: T;
}

/** What a history keeps of one project: what undo brings back and what redo does, the next of either at the end. */
export interface StoredHistory<T> {
  readonly past: readonly Entry<T>[];
  readonly future: readonly Entry<T>[];
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
  private past: Entry<T>[];
  private future: Entry<T>[];
  private merge = "";
  private listeners = new Set<(value: T, change: Change) => void>();

  constructor(
    private present: T,
    kept: StoredHistory<T> = { past: [], future: [] },
    /** What follows by itself from a change: the next value, of the old one and of the edited one. */
    private readonly settle: (old: T, next: T) => T = (_, next) => next,
  ) {
    this.past = [...kept.past];
    this.future = [...kept.future];
  }

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

  get kept(): StoredHistory<T> {
    return { past: this.past, future: this.future };
  }

  /** Every state from the first on, with what led to it, and the number of the present one. */
  get states(): { readonly all: readonly Entry<T>[]; readonly now: number } {
    const values = [
      ...this.past.map((one) => one.value),
      this.present,
      ...this.future.map((one) => one.value).reverse(),
    ];
    const labels = [
      "the beginning",
      ...this.past.map((one) => one.label),
      ...this.future.map((one) => one.label).reverse(),
    ];
    return { all: values.map((value, index) => ({ value, label: labels[index]! })), now: this.past.length };
  }

  subscribe(listener: (value: T, change: Change) => void): () => void {
    this.listeners.add(listener);
    return () => this.listeners.delete(listener);
  }

  /** Make a new value that undo takes back. An edit that gives the same value back changes nothing. */
  change(label: string, edit: (value: T) => T, options: ChangeOptions = {}): void {
    const { merge = "", draft = false, typed = false } = options;
    const edited = edit(this.present);
    const next = edited === this.present ? edited : this.settle(this.present, edited);
    if (next !== this.present) {
      if (!merge || merge !== this.merge) this.past.push({ label, value: this.present });
      this.merge = merge;
      this.future = [];
      this.present = next;
    } else if (draft) {
      return;
    }
    this.notify({ label, draft, typed });
  }

  /** Put something beside the point of undo, such as what was drawn, into the present value. */
  amend(edit: (value: T) => T): void {
    const next = edit(this.present);
    if (next === this.present) return;
    this.present = next;
    this.notify({ label: "", draft: false, typed: false });
  }

  /** Take over what was done on another page; undo brings back what was here, however often that page did something. */
  follow(next: T, label: string): void {
    if (this.merge !== FOLLOWED) this.past.push({ label, value: this.present });
    this.merge = FOLLOWED;
    this.future = [];
    this.present = next;
    this.notify({ label: "", draft: false, typed: false, elsewhere: true });
  }

  /** Begin with another value, which has a history of its own. */
  begin(value: T, { past, future }: StoredHistory<T>): void {
    [this.past, this.future, this.present, this.merge] = [[...past], [...future], value, ""];
    this.notify({ label: "", draft: false, typed: false, elsewhere: true });
  }

  /** Go to the state of that number of `states`. */
  go(number: number): void {
    const steps = number - this.past.length;
    const [from, to] = steps < 0 ? [this.past, this.future] : [this.future, this.past];
    for (let left = Math.abs(steps); left > 1; left -= 1) this.step(from, to);
    if (steps) this.move(from, to, steps < 0 ? "Undo" : "Redo");
  }

  undo(): boolean {
    return this.move(this.past, this.future, "Undo");
  }

  redo(): boolean {
    return this.move(this.future, this.past, "Redo");
  }

  private move(from: Entry<T>[], to: Entry<T>[], word: string): boolean {
    const label = this.step(from, to);
    if (label !== null) this.notify({ label: `${word} ${label}`, draft: false, typed: false });
    return label !== null;
  }

  private step(from: Entry<T>[], to: Entry<T>[]): string | null {
    const entry = from.pop();
    if (!entry) return null;
    to.push({ label: entry.label, value: this.present });
    this.present = entry.value;
    this.merge = "";
    return entry.label;
  }

  private notify(change: Change): void {
    for (const listener of this.listeners) listener(this.present, change);
  }
}
