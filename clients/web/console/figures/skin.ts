// Skin that gives way where something presses on somebody: corners of their figure's file that lie elsewhere than at rest
// (vistel/render/pressed_skin.py), so that the bones carry them along. Soft things do as well (dents.ts).
import { type BufferAttribute, type Mesh, Vector3 } from "three";

export interface PressedRow {
  who: string; // participant or thing
  step_m: number; // of offsets
  corners: string; // in base64: uint32 each, through all meshes of the file
  offsets: string; // three int8 each
  normals: string; // three int8 each, of 127
}

/** Whose skin is pressed now; all others have theirs as it is at rest. */
export interface Skin {
  kind: "skin";
  people: PressedRow[];
}

interface Part {
  mesh: Mesh;
  first: number; // corner of the file
  place: BufferAttribute;
  normal: BufferAttribute;
  atRest: { place: Float32Array; normal: Float32Array } | null; // once it has been pressed
}

export class Pressed {
  private readonly parts: Part[] = [];
  private readonly count: number; // of corners
  private pressed = new Uint32Array();

  /** meshes: of the file, in its order. */
  constructor(meshes: readonly Mesh[]) {
    let first = 0;
    for (const mesh of meshes) {
      const { position, normal } = mesh.geometry.attributes;
      this.parts.push({ mesh, first, place: position as BufferAttribute, normal: normal as BufferAttribute, atRest: null });
      first += position!.count;
    }
    this.count = first;
  }

  /** The pressed corners, and where each is in the room [m]. */
  places(): [corner: number, x: number, y: number, z: number][] {
    return [...this.pressed].map((corner) => {
      const { mesh, first } = this.partOf(corner);
      return [corner, ...mesh.localToWorld(mesh.getVertexPosition(corner - first, new Vector3())).toArray()];
    });
  }

  /** null: nothing presses any more; neither does a row that is not of this file. */
  press(row: PressedRow | null): void {
    const now = row && this.read(row);
    if (!now && !this.pressed.length) return;
    for (const corner of this.pressed) {
      const { first, place, normal, atRest } = this.partOf(corner);
      const at = 3 * (corner - first);
      for (let k = at; k < at + 3; k++) {
        place.array[k] = atRest!.place[k]!;
        normal.array[k] = atRest!.normal[k]!;
      }
    }
    this.pressed = now ? now.corners : new Uint32Array();
    this.pressed.forEach((corner, n) => {
      const part = this.partOf(corner);
      const { first, place, normal } = part;
      part.atRest ??= { place: Float32Array.from(place.array), normal: Float32Array.from(normal.array) };
      const at = 3 * (corner - first);
      for (let axis = 0; axis < 3; axis++) {
        place.array[at + axis] = part.atRest.place[at + axis]! + row!.step_m * now!.offsets[3 * n + axis]!;
        normal.array[at + axis] = now!.normals[3 * n + axis]! / 127;
      }
    });
    for (const { place, normal, atRest } of this.parts) if (atRest) place.needsUpdate = normal.needsUpdate = true;
  }

  private read(row: PressedRow) {
    const all = bytes(row.corners);
    const corners = new Uint32Array(all, 0, all.byteLength >> 2);
    const [offsets, normals] = [new Int8Array(bytes(row.offsets)), new Int8Array(bytes(row.normals))];
    const whole = offsets.length === 3 * corners.length && normals.length === offsets.length;
    return whole && corners.every((corner) => corner < this.count) ? { corners, offsets, normals } : null;
  }

  private partOf(corner: number): Part {
    return this.parts.findLast(({ first }) => first <= corner)!;
  }
}

function bytes(base64: string): ArrayBuffer {
  return Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0)).buffer;
}
