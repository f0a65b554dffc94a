// Names over heads inside a headset, where the page's own text is not seen; under a name what its owner holds, and for a while what they
// have written.
import { Group, Vector3 } from "three";
import { dispose } from "../console/dispose";
import { labelOf } from "../console/labels";
import type { Room } from "../console/room";
import type { Line } from "../console/wire";
import { grow, type Plate, plate, write } from "./plates";
import { text as word } from "./words";

const NEAR_M = 1.5; // from here on signs grow with their distance, so that they stay readable...
const MOST_GROWN = 3; // ... up to here
const MOST_LINES = 5; // of what somebody has written
const STAYS_MS = 6000; // what was written...
const READING_MS = 70; // ... and so much longer for each letter
const TALKS = "#85cf9b";

interface Sign {
  mesh: Plate;
  says: string; // what is drawn on it...
  edge: string; // ... and the colour of its edge, or none
}

/** In the headset's space. */
export class Signs extends Group {
  private readonly all = new Map<string, Sign>();
  private readonly written = new Map<string, { text: string; untilMs: number }>();
  private known: Set<string> | null = null; // lines that have come

  constructor(
    private readonly room: Room,
    private readonly who: string,
  ) {
    super();
  }

  /** All lines there are: those that have come since the last time are shown with who wrote them. now: of `performance` [ms]. */
  hear(lines: Line[], now: number): void {
    const fresh = this.known ? lines.filter((line) => !this.known!.has(line.id)) : [];
    for (const { who, text, to } of fresh)
      this.written.set(who, { text: to ? `${word("to_you")} ${text}` : text, untilMs: now + STAYS_MS + READING_MS * text.length });
    this.known = new Set(lines.map((line) => line.id));
  }

  /** What the sign of somebody says; an empty text: they have none. */
  of(name: string): string {
    return this.all.get(name)?.says ?? "";
  }

  /** head: where the guest looks from, in the room [m]. */
  step(head: Vector3, now: number): void {
    for (const [who, { untilMs }] of this.written) if (untilMs <= now) this.written.delete(who);
    for (const [name, { mesh }] of this.all) {
      if (this.room.figures.get(name)?.root.visible) continue;
      this.take(mesh);
      this.all.delete(name);
    }
    for (const [name, figure] of this.room.figures) {
      if (name === this.who || !figure.root.visible) continue;
      const sign = this.drawn(name);
      const at = figure.overHead();
      const grown = Math.min(MOST_GROWN, Math.max(1, at.distanceTo(head) / NEAR_M));
      grow(sign.mesh, grown);
      at.y += sign.mesh.scale.y / 2; // it stands on its place, and grows upwards
      sign.mesh.position.copy(this.worldToLocal(at));
      sign.mesh.lookAt(head);
    }
  }

  /** Take them all down. */
  close(): void {
    for (const { mesh } of this.all.values()) this.take(mesh);
    this.all.clear();
  }

  /** The sign of somebody, drawn anew where it says something else now. */
  private drawn(name: string): Sign {
    const label = labelOf(this.room, name);
    const written = this.written.get(name)?.text ?? "";
    const says = [label.sign, label.text, label.holds, written].filter((part) => part).join("\n");
    const edge = label.talks ? TALKS : "";
    const sign = this.all.get(name) ?? this.added(name);
    if (sign.says === says && sign.edge === edge) return sign;
    Object.assign(sign, { says, edge });
    const parts = [
      { text: label.sign, large: true, colour: "#ffd65c", most: 1 },
      { text: label.text, large: true, colour: "#f1f2f4", most: 1 },
      { text: label.holds, large: false, colour: "#a9cbf3", most: 1 },
      { text: written, large: false, colour: "#ffffff", most: MOST_LINES },
    ];
    write(sign.mesh, parts, edge);
    return sign;
  }

  private added(name: string): Sign {
    const sign: Sign = { mesh: plate(), says: "", edge: "" };
    this.add(sign.mesh);
    this.all.set(name, sign);
    return sign;
  }

  private take(mesh: Plate): void {
    mesh.removeFromParent();
    dispose(mesh);
  }
}
