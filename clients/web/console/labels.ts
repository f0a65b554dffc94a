// Names over heads, as text of the page: they stay sharp, and screen readers find them.
import { type Camera, Vector3 } from "three";
import { frontInRoom } from "./fronts";
import { panelText } from "./panel_words";
import type { Room } from "./room";
import type { Signals } from "./wire";

const MARGIN_PX = 4;
const BREAST_M = 0.62; // below the place over a head

/** A rectangle of the page [px]. */
interface Box {
  left: number;
  right: number;
  top: number;
  bottom: number;
}

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

/** Where boards and panels that can be read stand in the picture. */
function readIn(room: Room, camera: Camera, width: number, height: number): Box[] {
  const boxes: Box[] = [];
  for (const { about, node } of room.things.values()) {
    if (!about.front || !node.visible) continue;
    const { centre, normal, corners } = frontInRoom(about.front, node);
    const seen = corners.map((corner) => corner.project(camera));
    if (normal.dot(camera.position.clone().sub(centre)) <= 0 || seen.some(({ z }) => z > 1)) continue;
    const [xs, ys] = [seen.map(({ x }) => (0.5 + 0.5 * x) * width), seen.map(({ y }) => (0.5 - 0.5 * y) * height)];
    boxes.push({ left: Math.min(...xs), right: Math.max(...xs), top: Math.min(...ys), bottom: Math.max(...ys) });
  }
  return boxes;
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
    const read = readIn(this.room, this.room.camera, width, height);
    for (const [name, figure] of this.room.figures) {
      const label = this.all.get(name) ?? this.added(name);
      const over = figure.overHead().clone();
      seen.copy(over).project(this.room.camera);
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
      const high = label.offsetHeight + MARGIN_PX;
      const placed = () => ({
        x: Math.min(width - half, Math.max(half, (0.5 + 0.5 * seen.x) * width)),
        y: Math.max(high, (0.5 - 0.5 * seen.y) * height),
      });
      const covers = ({ x, y }: { x: number; y: number }) =>
        read.some((box) => x + half > box.left && x - half < box.right && y > box.top && y - high < box.bottom);
      let at = placed();
      if (covers(at)) {
        seen.copy(over.setY(over.y - BREAST_M)).project(this.room.camera); // they hide what is behind them there anyway
        at = placed();
      }
      shown.push({ label, ...at, half, high, far: seen.z });
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
