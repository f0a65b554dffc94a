// Names over heads, as text of the page: they stay sharp, and screen readers find them.
import { Vector3 } from "three";
import { panelText } from "./panel_words";
import type { Room } from "./room";

const MARGIN_PX = 4;

export class Labels {
  private readonly all = new Map<string, HTMLElement>();

  constructor(
    private readonly room: Room,
    private readonly parent: HTMLElement,
  ) {}

  /** whose: through whose eyes the room is seen; they have no label. */
  draw(whose: string): void {
    const { clientWidth: width, clientHeight: height } = this.room.canvas;
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
      const text = figure.about.shown;
      const holds = this.room.held.grasps.filter(([who]) => who === name).map(([, , id]) => this.room.things.get(id)?.about.name ?? id);
      const more = holds.length ? panelText("holdsThese", [...new Set(holds)].join(", ")) : "";
      const [first, second] = label.children as unknown as [HTMLElement, HTMLElement];
      if (first.textContent !== text) first.textContent = text;
      if (second.textContent !== more) second.textContent = more;
      label.classList.toggle("talks", figure.talks);
      const half = label.offsetWidth / 2 + MARGIN_PX;
      const x = Math.min(width - half, Math.max(half, (0.5 + 0.5 * seen.x) * width));
      const y = Math.max(label.offsetHeight + MARGIN_PX, (0.5 - 0.5 * seen.y) * height);
      label.style.transform = `translate(${x.toFixed(1)}px, ${y.toFixed(1)}px) translate(-50%, -100%)`;
    }
  }

  private added(name: string): HTMLElement {
    const label = document.createElement("div");
    label.className = "label";
    label.append(document.createElement("b"), document.createElement("span"));
    this.parent.append(label);
    this.all.set(name, label);
    return label;
  }
}
