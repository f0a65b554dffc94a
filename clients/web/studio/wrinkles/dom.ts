// Small ways to make elements, in the language of the page.

import { said } from "../said";

type Attributes = Record<string, string | number | boolean | ((event: Event) => void)>;
type Child = Node | string;

/** An element with attributes (functions are listeners, by the event's name) and children. */
export function make<K extends keyof HTMLElementTagNameMap>(
  tag: K,
  attributes: Attributes = {},
  ...children: Child[]
): HTMLElementTagNameMap[K] {
  const out = document.createElement(tag);
  for (const [key, value] of Object.entries(attributes)) {
    if (typeof value === "function") out.addEventListener(key, value);
    else if (typeof value === "boolean") out.toggleAttribute(key, value);
    else out.setAttribute(key, key === "title" || key === "aria-label" ? said(String(value)) : String(value));
  }
  out.append(...children.map((child) => (typeof child === "string" ? said(child) : child)));
  return out;
}

/** The element of the page with that id; the page is wrong without it. */
export function byId<T extends HTMLElement>(id: string): T {
  const found = document.getElementById(id);
  if (!found) throw new Error(`the page lacks #${id}`);
  return found as T;
}

/** A canvas made as large as it is shown, in device pixels; the factor between them. */
export function fitted(canvas: HTMLCanvasElement): number {
  const ratio = window.devicePixelRatio || 1;
  const width = Math.max(1, Math.round(canvas.clientWidth * ratio));
  const height = Math.max(1, Math.round(canvas.clientHeight * ratio));
  if (canvas.width !== width || canvas.height !== height) {
    canvas.width = width;
    canvas.height = height;
  }
  return ratio;
}

/** A function that has `paint` called with the next picture of the screen, once however often it is asked. */
export function nextFrame(paint: () => void): () => void {
  let asked = false;
  return () => {
    if (asked) return;
    asked = true;
    requestAnimationFrame(() => {
      asked = false;
      paint();
    });
  };
}

/** Whether keys belong to a field that somebody types in. */
export function typing(event: KeyboardEvent): boolean {
  const at = event.target;
  if (at instanceof HTMLInputElement) return at.type !== "range" && at.type !== "checkbox";
  return at instanceof HTMLSelectElement || at instanceof HTMLTextAreaElement;
}

/** A name such as left_lower_arm for people. */
export function words(name: string): string {
  const text = name.replaceAll("_", " ");
  return text.charAt(0).toUpperCase() + text.slice(1);
}
