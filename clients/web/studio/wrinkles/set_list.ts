// The sets of wrinkles, region by region, and how much of each is there now.

import { make, words } from "./dom";
import type { State } from "./state";

export class SetList {
  private key = "";
  private bars = new Map<number, HTMLElement>();

  constructor(
    private readonly panel: HTMLElement,
    private readonly state: State,
  ) {
    state.listen(() => this.draw());
  }

  private draw(): void {
    const { form, selection, faults } = this.state;
    const key = JSON.stringify([form.sets.map((s) => [s.name, s.region, s.wrinkles.length]), selection.set, faults.map((f) => f.set)]);
    if (key !== this.key) {
      this.key = key;
      this.rows();
    }
    for (const [k, bar] of this.bars) {
      const weights = this.state.sets.filter((s) => s.set === k).map((s) => s.weight);
      bar.style.width = `${100 * Math.max(0, ...weights)}%`;
    }
  }

  private rows(): void {
    const { state } = this;
    this.bars.clear();
    const out: HTMLElement[] = [];
    for (const region of state.opened.regions) {
      const mine = state.form.sets.map((s, k) => [s, k] as const).filter(([s]) => s.region === region.name);
      if (mine.length === 0) continue;
      out.push(make("h3", {}, words(region.name)));
      for (const [set, k] of mine) {
        const bar = make("b", {});
        this.bars.set(k, bar);
        const bad = state.faults.some((f) => f.set === k);
        out.push(
          make(
            "button",
            { class: `row${k === state.selection.set ? " chosen" : ""}${bad ? " bad" : ""}`, click: () => state.select({ set: k, wrinkle: -1 }), "data-set": set.name },
            make("span", {}, words(set.name)),
            make("em", {}, set.wrinkles.length > 0 ? String(set.wrinkles.length) : "pull"),
            make("i", {}, bar),
          ),
        ); // prettier-ignore
      }
    }
    this.panel.replaceChildren(...out);
    this.panel.querySelector(".chosen")?.scrollIntoView({ block: "nearest" });
  }
}
