// Names over heads, as text of the page: they stay sharp, and screen readers find them.
import { Vector3 } from "three";
import { panelText } from "./panel_words";
import type { Room } from "./room";
import type { Signals } from "./wire";

const MARGIN_PX = 4;

/** What stands over the head of somebody who is in the room: what they say without words, their name, what they hold, and whether
 * they talk. */
export function labelOf(room: Room, name: string): { sign: string; text: string; holds: string; talks: boolean } {
  const figure = room.figures.get(name)!;
  const held = room.held.grasps.filter(([who]) => who === name).map(([, , id]) => room.things.get(id)?.about.name ?? id);
  const holds = held.length ? panelText("holdsThese", [...new Set(held)].join(", ")) : "";
  return { sign: signOf(room.signals, name), text: figure.about.shown, holds, talks: figure.talks };
}

/** That somebody's hand is up, and where in the row, and how they react. */
function signOf(signals: Signals, name: string): string {
  const place = signals.raised.findIndex(([who]) => who === name) + 1;
  const reaction = signals.reactions.find(([who]) => who === name)?.[1];
  return [place > 0 && panelText("handUp", place), reaction && panelText(reaction)].filter(Boolean).join(" · ");
}

interface Shown {
  label: HTMLElement;
  x: number; // of its middle [px]
  y: number; // of its lower edge
  half: number; // of its width
  high: number;
  far: number; // from the camera
}

/** No label covers another: that of who is farther away is put above those of the nearer, while there is room. */
function apart(shown: Shown[]): Shown[] {
  const placed: Shown[] = [];
  for (const one of shown.sort((a, b) => a.far - b.far)) {
    const beside = placed.filter((other) => Math.abs(other.x - one.x) < other.half + one.half).sort((a, b) => b.y - a.y);
    for (const other of beside) {
      if (one.y > other.y - other.high && one.y - one.high < other.y) one.y = other.y - other.high;
    }
    one.y = Math.max(one.high, one.y);
    placed.push(one);
  }
  return placed;
}

export class Labels {
  private readonly all = new Map<string, HTMLElement>();

  constructor(
    private readonly room: Room,
    private readonly parent: HTMLElement,
  ) {}

  /** whose: through whose eyes the room is seen; they have no label. */
  draw(whose: string): void {
    const { clientWidth: width, clientHeight: height } = this.room.canvas;
    const shown: Shown[] = [];
    for (const [name, label] of this.all) {
      if (this.room.figures.has(name)) continue;
      label.remove();
      this.all.delete(name);
    }
    const seen = new Vector3();
    for (const [name, figure] of this.room.figures) {
      const label = this.all.get(name) ?? this.added(name);
      seen.copy(figure.overHead()).project(this.room.camera);
      const hidden = name === whose || !figure.root.visible || seen.z > 1 || Math.abs(seen.x) > 1.2 || Math.abs(seen.y) > 1.3;
      label.hidden = hidden;
      if (hidden) continue;
      const { sign, text, holds, talks } = labelOf(this.room, name);
      for (const [n, says] of [sign, text, holds].entries()) {
        const part = label.children[n]!;
        if (part.textContent !== says) part.textContent = says;
      }
      label.classList.toggle("talks", talks);
      const half = label.offsetWidth / 2 + MARGIN_PX;
      const x = Math.min(width - half, Math.max(half, (0.5 + 0.5 * seen.x) * width));
      const y = Math.max(label.offsetHeight + MARGIN_PX, (0.5 - 0.5 * seen.y) * height);
      shown.push({ label, x, y, half, high: label.offsetHeight + MARGIN_PX, far: seen.z });
    }
    for (const { label, x, y } of apart(shown)) {
      label.style.transform = `translate(${x.toFixed(1)}px, ${y.toFixed(1)}px) translate(-50%, -100%)`;
    }
  }

  private added(name: string): HTMLElement {
    const label = document.createElement("div");
    label.className = "label";
    label.append(...["em", "b", "span"].map((part) => document.createElement(part)));
    this.parent.append(label);
    this.all.set(name, label);
    return label;
  }
}
