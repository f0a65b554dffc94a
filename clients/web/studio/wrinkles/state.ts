// What the page shows and edits, in one place; views draw it and change it through `edit`.

import { controlPoints, sampled, tidied, type OnCurve } from "./geometry";
import { History } from "./history";
import type { Fault, Form, Jitter, Opened, Region, SetState, Shape, Vec, Wrinkle, WrinkleSet } from "./types";

export type Tool = "select" | "draw" | "branch";
export type Mode = "wrinkles" | "photograph";

/** What is selected; -1 for none. */
export interface Selection {
  set: number;
  side: string;
  wrinkle: number;
  branch: number;
  point: number;
}

export type Change = "form" | "selection" | "look" | "answer";

export class State {
  form: Form;
  selection: Selection = { set: -1, side: "", wrinkle: -1, branch: -1, point: -1 };
  tool: Tool = "select";
  mode: Mode = "wrinkles";
  bends: Record<string, number> = {};
  held = true;
  faults: Fault[] = [];
  sets: SetState[] = [];
  jitters: Jitter[] = [];
  saved: string;
  readonly history: History<Form>;
  private listeners: ((change: Change) => void)[] = [];

  constructor(readonly opened: Opened) {
    this.form = opened.form;
    this.history = new History(opened.form);
    this.saved = JSON.stringify(opened.form);
    for (const bend of opened.bends) this.bends[bend.name] = bend.start;
  }

  listen(listener: (change: Change) => void): void {
    this.listeners.push(listener);
  }

  tell(change: Change): void {
    for (const listener of this.listeners) listener(change);
  }

  /** Changes the form; `merge` joins steps of one drag in the history. */
  edit(label: string, change: (form: Form) => void, merge = ""): void {
    change(this.form);
    tidied(this.form);
    this.history.push(label, this.form, merge);
    this.tell("form");
  }

  undo(): string | null {
    return this.restored(this.history.undo());
  }

  redo(): string | null {
    return this.restored(this.history.redo());
  }

  private restored(step: { label: string; state: Form } | null): string | null {
    if (!step) return null;
    this.form = step.state;
    const { set, wrinkle, branch, point } = this.selection;
    if (!this.form.sets[set]) this.select({ set: this.form.sets.length - 1, wrinkle: -1 });
    else if (!this.wrinkle) this.selection.wrinkle = -1;
    const points = this.shape?.branches[branch]?.points;
    if (wrinkle >= 0 && (!points || !points[point])) {
      this.selection.branch = -1;
      this.selection.point = -1;
    }
    this.tell("form");
    this.tell("selection");
    return step.label;
  }

  get dirty(): boolean {
    return JSON.stringify(this.form) !== this.saved;
  }

  select(part: Partial<Selection>): void {
    const next = { ...this.selection, ...part };
    if (part.set !== undefined && part.set !== this.selection.set) {
      next.wrinkle = part.wrinkle ?? -1;
      next.branch = part.branch ?? -1;
      next.point = part.point ?? -1;
      const sides = Object.keys(this.regionOf(this.form.sets[next.set])?.planes ?? {});
      if (!sides.includes(next.side)) next.side = sides[0] ?? "";
    }
    if (part.wrinkle !== undefined && part.branch === undefined) next.branch = next.point = -1;
    this.selection = next;
    this.tell("selection");
  }

  get set(): WrinkleSet | undefined {
    return this.form.sets[this.selection.set];
  }

  get wrinkle(): Wrinkle | undefined {
    return this.set?.wrinkles[this.selection.wrinkle];
  }

  get shape(): Shape | undefined {
    return this.wrinkle && this.shapeOf(this.wrinkle);
  }

  shapeOf(w: Wrinkle): Shape | undefined {
    return this.form.shapes.find((s) => s.name === w.shape) ?? this.opened.shapes[w.shape];
  }

  regionOf(set: WrinkleSet | undefined): Region | undefined {
    return set && this.opened.regions.find((r) => r.name === set.region);
  }

  /** Width and height of the selected region [m]. */
  get plane(): Vec {
    return this.regionOf(this.set)?.planes[this.selection.side] ?? [0.3, 0.5];
  }

  /** Control points of a wrinkle of the selected set on its plane. */
  pointsOf(n: number): Vec[][] {
    const w = this.set?.wrinkles[n];
    const shape = w && this.shapeOf(w);
    if (!w || !shape) return [];
    const moved =
      w.wrinkledness > 0
        ? this.jitters.find((j) => j.set === this.selection.set && j.wrinkle === n)?.branches
        : undefined;
    return controlPoints(w, shape, this.plane, moved);
  }

  curvesOf(n: number): OnCurve[][] {
    return this.pointsOf(n).map((points) => sampled(points));
  }

  /** How much of the selected set is there on the shown side. */
  get now(): SetState | undefined {
    return this.sets.find((s) => s.set === this.selection.set && s.side === this.selection.side);
  }
}
