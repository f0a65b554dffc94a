// Sliders that bend the figure.

import { make } from "./dom";
import type { State } from "./state";
import type { Bend } from "./types";

export class BendsView {
  private readonly inputs = new Map<string, { slider: HTMLInputElement; out: HTMLElement; bend: Bend }>();

  constructor(
    panel: HTMLElement,
    private readonly state: State,
    private readonly bent: () => void,
  ) {
    const groups = new Map<string, HTMLElement>();
    for (const bend of state.opened.bends) {
      let group = groups.get(bend.group);
      if (!group) {
        group = make("div", { class: "group" }, make("h3", {}, bend.group));
        groups.set(bend.group, group);
        panel.append(group);
      }
      const step = bend.unit === "°" ? 1 : 0.01;
      const slider = make("input", { type: "range", min: bend.low, max: bend.high, step, value: bend.start, "aria-label": bend.label, "data-bend": bend.name });
      const out = make("output", {}, "");
      slider.addEventListener("input", () => {
        this.state.bends[bend.name] = Number(slider.value);
        this.follow();
        this.bent();
      });
      slider.addEventListener("dblclick", () => {
        this.state.bends[bend.name] = bend.start;
        this.follow();
        this.bent();
      });
      this.inputs.set(bend.name, { slider, out, bend });
      group.append(make("label", { class: "bend", title: "Double-click: as at first" }, make("span", {}, bend.label), slider, out));
    }
    this.follow();
  }

  /** Shows the state's values. */
  follow(): void {
    for (const [name, { slider, out, bend }] of this.inputs) {
      const value = this.state.bends[name] ?? bend.start;
      if (Number(slider.value) !== value) slider.value = String(value);
      out.textContent = bend.unit === "°" ? `${Math.round(value)}°` : `${Math.round(100 * value)} %`;
      slider.style.setProperty("--at", `${(100 * (value - bend.low)) / (bend.high - bend.low)}%`);
    }
  }

  reset(): void {
    for (const { bend } of this.inputs.values()) this.state.bends[bend.name] = bend.start;
    this.follow();
    this.bent();
  }
}
