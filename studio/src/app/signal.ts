/** A value that tells when it changes. */
export class Signal<T> {
  private listeners = new Set<(value: T, before: T) => void>();

  constructor(private current: T) {}

  get value(): T {
    return this.current;
  }

  set value(next: T) {
    if (Object.is(next, this.current)) return;
    const before = this.current;
    this.current = next;
    for (const listener of this.listeners) listener(next, before);
  }

  /** Change some fields of a value that is a mapping. */
  update(part: Partial<NonNullable<T>>): void {
    const same = Object.entries(part).every(([key, value]) => Object.is(this.current[key as keyof T], value));
    if (!same) this.value = { ...this.current, ...part };
  }

  subscribe(listener: (value: T, before: T) => void): () => void {
    this.listeners.add(listener);
    return () => this.listeners.delete(listener);
  }
}
