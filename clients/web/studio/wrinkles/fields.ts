// Fields of the inspector: a label, a slider and a number that are one value.

import { make } from "./dom";

export interface Range {
  low: number;
  high: number;
  step: number;
  unit?: string;
}

/** A number by slider and by typing. change: told the value, and whether the slider is still held. */
export function number(
  label: string,
  value: number,
  range: Range,
  change: (value: number, held: boolean) => void,
): HTMLElement {
  const shown = (x: number): string => String(Number(x.toFixed(4)));
  const field = make("input", { type: "number", step: range.step, min: range.low, max: range.high, value: shown(value), "aria-label": label });
  const slider = make("input", { type: "range", min: range.low, max: range.high, step: range.step, value, tabindex: -1, "aria-label": `${label} slider` });
  const fill = (): void => {
    slider.style.setProperty("--at", `${(100 * (Number(slider.value) - range.low)) / (range.high - range.low)}%`);
  };
  fill();
  slider.addEventListener("input", () => {
    field.value = shown(Number(slider.value));
    fill();
    change(Number(slider.value), true);
  });
  slider.addEventListener("change", () => change(Number(slider.value), false));
  field.addEventListener("change", () => {
    const typed = Number(field.value);
    if (!Number.isFinite(typed)) return;
    const kept = Math.min(range.high, Math.max(range.low, typed));
    field.value = shown(kept);
    slider.value = String(kept);
    fill();
    change(kept, false);
  });
  return make("label", { class: "field" }, make("span", {}, label), slider, make("span", { class: "value" }, field, make("i", {}, range.unit ?? "")));
}

export function choice(
  label: string,
  value: string,
  options: (string | [string, string])[],
  change: (value: string) => void,
): HTMLElement {
  const select = make("select", { "aria-label": label, change: () => change(select.value) });
  for (const option of options) {
    const [key, text] = typeof option === "string" ? [option, option] : option;
    select.append(make("option", { value: key, selected: key === value }, text));
  }
  return make("label", { class: "field wide" }, make("span", {}, label), select);
}

export function text(label: string, value: string, change: (value: string) => void): HTMLElement {
  const field = make("input", { type: "text", value, "aria-label": label, spellcheck: "false" });
  field.addEventListener("change", () => change(field.value));
  return make("label", { class: "field wide" }, make("span", {}, label), field);
}

export function check(label: string, value: boolean, change: (value: boolean) => void): HTMLElement {
  const field = make("input", { type: "checkbox", checked: value, "aria-label": label });
  field.addEventListener("change", () => change(field.checked));
  return make("label", { class: "field wide check" }, make("span", {}, label), field);
}
