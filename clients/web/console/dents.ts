// Soft things that are dented where something presses on them (vistel/render/pressed_things.py).
import { type Group, Mesh } from "three";
import { Pressed, type PressedRow } from "./figures/skin";

/** Which thing is dented in one of the few places of the stream for them; null: none. */
export interface Dents {
  kind: "dents";
  place: number;
  thing: (PressedRow & { file: string }) | null; // file: whose corners they are
}

export class DentedThings {
  private readonly rows = new Map<number, Dents["thing"]>();
  private readonly shown = new Map<string, { file: string; surface: Pressed }>();

  constructor(private readonly changed: () => void) {}

  receive({ place, thing }: Dents): void {
    const before = this.rows.get(place);
    this.rows.set(place, thing);
    if (before && before.who !== thing?.who) this.press(before.who);
    if (thing) this.press(thing.who);
  }

  /** A thing is shown by what a file holds. */
  wear(id: string, file: string, scene: Group): void {
    const meshes: Mesh[] = [];
    scene.traverse((part) => part instanceof Mesh && meshes.push(part));
    this.shown.set(id, { file, surface: new Pressed(meshes) });
    this.press(id);
  }

  forget(id: string): void {
    this.shown.delete(id);
  }

  /** Corners of a thing that are elsewhere than at rest, and where each is in the room [m]. */
  corners(id: string): [corner: number, x: number, y: number, z: number][] {
    return this.shown.get(id)?.surface.places() ?? [];
  }

  private press(id: string): void {
    const shown = this.shown.get(id);
    const row = [...this.rows.values()].find((dents) => dents?.who === id && dents.file === shown?.file);
    shown?.surface.press(row ?? null);
    this.changed();
  }
}
