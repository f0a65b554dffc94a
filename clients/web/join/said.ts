// What was said to the room and what it answered, inside a headset: before the guest, below where they look.
import { Group, Vector3 } from "three";
import { dispose } from "../console/dispose";
import type { Caption } from "../console/wire";
import { grow, type Part, plate, write } from "./plates";

const AHEAD_M = 1.2;
const BELOW_M = 0.42;
const MOST_LINES = 2; // of each thing that is said

/** In the headset's space. */
export class Said extends Group {
  private readonly plate = plate();
  private says = "";

  constructor() {
    super();
    this.plate.visible = false;
    this.plate.renderOrder = 1; // before signs that are farther
    this.add(this.plate);
  }

  /** What stands there; empty: nothing. */
  get words(): string {
    return this.says;
  }

  hear(captions: Caption[]): void {
    const parts = captions.flatMap(({ who, text, mark, reply }): Part[] => [
      { text: `${who}: ${text} ${mark}`, large: false, colour: "#ffffff", most: MOST_LINES },
      { text: reply, large: false, colour: "#ffd65c", most: MOST_LINES },
    ]);
    const says = parts.flatMap(({ text }) => (text ? [text] : [])).join("\n");
    if (says === this.says) return;
    this.says = says;
    this.plate.visible = says !== "";
    if (!says) return;
    write(this.plate, parts, "");
    grow(this.plate, 1);
  }

  /** head: where the guest looks from, and a point before them, in the room [m]. */
  step(head: Vector3, before: Vector3): void {
    if (!this.plate.visible) return;
    const way = before.clone().sub(head).setY(0).normalize();
    const at = head.clone().addScaledVector(way, AHEAD_M);
    at.y -= BELOW_M;
    this.plate.position.copy(this.worldToLocal(at));
    this.plate.lookAt(head);
  }

  close(): void {
    this.plate.removeFromParent();
    dispose(this.plate);
  }
}
