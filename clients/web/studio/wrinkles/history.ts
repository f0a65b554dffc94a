// What was done, so that it can be undone: whole copies of what is edited; they are small.

export interface Step<T> {
  label: string;
  state: T;
}

export class History<T> {
  private undone: Step<T>[] = [];
  private done: Step<T>[] = [];
  private current: T;
  private last = "";

  constructor(
    start: T,
    private readonly most = 200,
  ) {
    this.current = structuredClone(start);
  }

  /** Keeps a state that came of doing `label`. merge: a name that later steps of the same doing share; they become one. */
  push(label: string, state: T, merge = ""): void {
    if (merge === "" || merge !== this.last) {
      this.done.push({ label, state: this.current });
      if (this.done.length > this.most) this.done.shift();
    }
    this.last = merge;
    this.undone = [];
    this.current = structuredClone(state);
  }

  /** The doing that `merge` named is over. */
  seal(): void {
    this.last = "";
  }

  undo(): Step<T> | null {
    return this.moved(this.done, this.undone);
  }

  redo(): Step<T> | null {
    return this.moved(this.undone, this.done);
  }

  get next(): { undo: string | null; redo: string | null } {
    return { undo: this.done.at(-1)?.label ?? null, redo: this.undone.at(-1)?.label ?? null };
  }

  private moved(from: Step<T>[], to: Step<T>[]): Step<T> | null {
    const step = from.pop();
    if (!step) return null;
    to.push({ label: step.label, state: this.current });
    this.current = step.state;
    this.last = "";
    return { label: step.label, state: structuredClone(step.state) };
  }
}
