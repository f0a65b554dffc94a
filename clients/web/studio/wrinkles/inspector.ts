// What is selected, in numbers: a point, its curve, its wrinkle.

import { make, words } from "./dom";
import { adjust, adjustSet, duplicate, remove, removeSet, reshape } from "./edits";
import { check, choice, number, text } from "./fields";
import { clamp } from "./geometry";
import type { State } from "./state";
import type { Drive, End, Wrinkle } from "./types";

const ENDS: [End, string][] = [
  ["taper", "Tapers off"],
  ["vanish", "Vanishes"],
  ["round", "Round"],
];

export class Inspector {
  private held = false;
  private key = "";

  constructor(
    private readonly panel: HTMLElement,
    private readonly state: State,
  ) {
    state.listen(() => this.draw());
    panel.addEventListener("pointerup", () => {
      this.held = false;
      this.state.history.seal();
    });
  }

  private draw(): void {
    if (this.held || (this.panel.contains(document.activeElement) && document.activeElement instanceof HTMLInputElement && document.activeElement.type === "text")) return;
    const { set, wrinkle, selection } = this.state;
    const key = JSON.stringify([set && { ...set, drive: 0 }, selection, wrinkle && this.state.shape]);
    if (key === this.key) return;
    this.key = key;
    const focus = this.panel.contains(document.activeElement) ? document.activeElement?.getAttribute("aria-label") : null;
    if (!set) this.panel.replaceChildren();
    else if (wrinkle) this.panel.replaceChildren(...this.ofPoint(), ...this.ofCurve(), ...this.ofWrinkle(wrinkle));
    else this.panel.replaceChildren(...this.ofSet());
    if (focus) this.panel.querySelector<HTMLElement>(`[aria-label="${focus}"]`)?.focus();
  }

  /** A slider that is held stays where it is while the page follows. */
  private step(name: string, held: boolean): string {
    this.held = held;
    if (!held) this.key = "";
    return held ? `field ${name}` : "";
  }

  private ofPoint(): HTMLElement[] {
    const { branch, point } = this.state.selection;
    const p = this.state.shape?.branches[branch]?.points[point];
    if (!p) return [];
    const count = this.state.shape?.branches[branch]?.points.length ?? 0;
    const set = (key: "intensity" | "thickness", value: number, held: boolean): void => {
      reshape(this.state, words(key), (_, shape) => {
        const of = shape.branches[branch]?.points[point];
        if (of) of[key] = value;
      }, this.step(key, held)); // prettier-ignore
    };
    return [
      heading(`Point ${point + 1} of ${count}`),
      number("Intensity", 100 * p.intensity, { low: -100, high: 100, step: 1, unit: "%" }, (x, held) => set("intensity", x / 100, held)),
      number("Width", 100 * p.thickness, { low: 5, high: 100, step: 1, unit: "%" }, (x, held) => set("thickness", x / 100, held)),
    ];
  }

  private ofCurve(): HTMLElement[] {
    const b = this.state.selection.branch;
    const branch = this.state.shape?.branches[b];
    if (!branch) return [];
    const count = this.state.shape?.branches.length ?? 0;
    const ends = (end: "start" | "end", value: string): void =>
      reshape(this.state, "Ends", (_, shape) => {
        const of = shape.branches[b];
        if (of) of[end] = value as End;
      });
    return [
      heading(count > 1 ? `Curve ${b + 1} of ${count}` : "Curve"),
      choice("Start", branch.start, ENDS, (x) => ends("start", x)),
      choice("End", branch.end, ENDS, (x) => ends("end", x)),
      number("Cap", branch.cap, { low: 0.2, high: 6, step: 0.1, unit: "radii" }, (x, held) =>
        reshape(this.state, "Cap", (_, shape) => {
          const of = shape.branches[b];
          if (of) of.cap = x;
        }, this.step("cap", held)),
      ),
    ]; // prettier-ignore
  }

  private ofWrinkle(w: Wrinkle): HTMLElement[] {
    const skin = this.state.set?.material === "skin";
    const put = (label: string, change: (w: Wrinkle) => void, held = false): void =>
      adjust(this.state, label, change, this.step(label, held));
    const size = typeof w.size === "number" ? w.size : Math.max(...w.size);
    return [
      heading("Wrinkle", button("Duplicate", "D", () => duplicate(this.state)), button("Delete", "Del", () => {
        this.state.select({ branch: -1, point: -1 });
        remove(this.state);
      })),
      make("p", { class: "quiet" }, words(w.shape), this.state.opened.shapes[w.shape] ? " (built in; its own once a point is moved)" : " (its own)"),
      number("Radius", 1000 * w.thickness, skin ? { low: 0.3, high: 10, step: 0.1, unit: "mm" } : { low: 2, high: 40, step: 0.5, unit: "mm" }, (x, held) =>
        put("Radius", (to) => (to.thickness = x / 1000), held)),
      number("Height", 1000 * w.intensity, skin ? { low: -4, high: 4, step: 0.05, unit: "mm" } : { low: -25, high: 25, step: 0.5, unit: "mm" }, (x, held) =>
        put("Height", (to) => (to.intensity = x / 1000), held)),
      number("Size", 1000 * size, { low: 2, high: 300, step: 1, unit: "mm" }, (x, held) =>
        put("Size", (to) => {
          const factor = x / 1000 / (typeof to.size === "number" ? to.size : Math.max(...to.size));
          to.size = typeof to.size === "number" ? to.size * factor : [to.size[0] * factor, to.size[1] * factor];
        }, held)),
      number("Turn", ((((w.turn + 180) % 360) + 360) % 360) - 180, { low: -180, high: 180, step: 1, unit: "°" }, (x, held) =>
        put("Turn", (to) => (to.turn = x), held)),
      number("Wrinkledness", 100 * w.wrinkledness, { low: 0, high: 100, step: 1, unit: "%" }, (x, held) =>
        put("Wrinkledness", (to) => (to.wrinkledness = x / 100), held)),
      number("Seed", w.seed, { low: 0, high: 99, step: 1 }, (x, held) => put("Seed", (to) => (to.seed = Math.round(x)), held)),
      check("Mirrored", w.mirrored, (x) => put("Mirror", (to) => (to.mirrored = x))),
    ]; // prettier-ignore
  }

  private ofSet(): HTMLElement[] {
    const { state } = this;
    const set = state.set;
    if (!set) return [];
    const names = state.form.sets.map((s) => s.name);
    return [
      heading("Set", button("Delete", "", () => removeSet(state))),
      text("Name", set.name, (value) => {
        const name = value.trim().toLowerCase().replace(/[^a-z0-9]+/g, "_").replace(/^[^a-z]+|_+$/g, "");
        if (name && !names.includes(name)) adjustSet(state, "Rename set", (s) => (s.name = name));
        this.key = "";
      }),
      choice("Material", set.material, [["cloth", "Cloth"], ["skin", "Skin"]], (x) =>
        adjustSet(state, "Material", (s) => (s.material = x as "cloth" | "skin"))),
      number("Lift", 100 * set.lift, { low: 0, high: 100, step: 5, unit: "%" }, (x, held) =>
        adjustSet(state, "Lift", (s) => (s.lift = x / 100), this.step("lift", held))),
      number("Memory", 100 * set.memory, { low: 0, high: 100, step: 5, unit: "%" }, (x, held) =>
        adjustSet(state, "Memory", (s) => (s.memory = x / 100), this.step("memory", held))),
      make("p", { class: "quiet" }, "Click a curve to edit it, or draw one with P."),
    ]; // prettier-ignore
  }
}

/** What drives the selected set, above its curve. */
export function driveChoices(state: State): HTMLElement[] {
  const set = state.set;
  if (!set) return [];
  const { joint, action, axis, curve } = set.drive;
  const now = action ? `action ${action}` : `joint ${joint}`;
  const options: [string, string][] = [
    ...state.opened.joints.map((j): [string, string] => [`joint ${j}`, words(j)]),
    ...state.opened.actions.map((a): [string, string] => [`action ${a}`, a]),
  ];
  if (!options.some(([key]) => key === now)) options.unshift([now, words(now.split(" ")[1] ?? "")]);
  const about = axis ? `${axis[0]},${axis[1]},${axis[2]}` : "";
  const axes: [string, string][] = [["", "whole angle"], ["1,0,0", "about x"], ["0,1,0", "about y"], ["0,0,1", "about z"], ["-1,0,0", "about -x"], ["0,-1,0", "about -y"], ["0,0,-1", "about -z"]]; // prettier-ignore
  if (!axes.some(([key]) => key === about)) axes.push([about, `about ${about}`]);
  const put = (label: string, change: (d: Drive) => void): void => adjustSet(state, label, (s) => change(s.drive));
  const out = [
    choice("Driven by", now, options, (value) =>
      put("Driver", (d) => {
        const [kind, name] = value.split(" ") as [string, string];
        const was = d.action !== null;
        d.joint = kind === "joint" ? name : null;
        d.action = kind === "action" ? name : null;
        if (kind === "action") d.axis = null;
        // Degrees and intensities are of another size: the curve keeps its form.
        if (was !== (d.action !== null)) {
          const high = Math.max(...d.curve.knots.map((k) => k[0]), 1e-6);
          const low = Math.min(0, ...d.curve.knots.map((k) => k[0]));
          const to = was ? 120 : 1;
          d.curve.knots = d.curve.knots.map(([x, y]) => [clamp(Math.round(((x - low) / (high - low)) * to * 100) / 100, 0, to), y]);
        }
      })),
    choice("Between knots", curve.form, [["smooth", "smooth"], ["linear", "straight"]], (value) =>
      put("Form of curve", (d) => (d.curve.form = value as "smooth" | "linear"))),
  ]; // prettier-ignore
  if (!action)
    out.splice(1, 0, choice("Rotation", about, axes, (value) =>
      put("Axis", (d) => (d.axis = value ? (value.split(",").map(Number) as [number, number, number]) : null)))); // prettier-ignore
  return out;
}

function heading(title: string, ...buttons: HTMLElement[]): HTMLElement {
  return make("h3", {}, title, make("span", { class: "grow" }), ...buttons);
}

function button(label: string, key: string, click: () => void): HTMLElement {
  return make("button", { class: "small", title: key ? `${label} (${key})` : label, click }, label);
}
