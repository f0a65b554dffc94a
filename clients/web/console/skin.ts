// Skin that gives way where something presses on somebody: corners of their figure's file that lie elsewhere than at rest
// (vistel/render/pressed_skin.py), so that the bones carry them along.
import { type BufferAttribute, type SkinnedMesh, Vector3 } from "three";

export interface SkinRow {
  who: string; // participant
  step_m: number; // of offsets
  corners: string; // in base64: uint32 each
  offsets: string; // three int8 each
  normals: string; // three int8 each, of 127
}

/** Whose skin is pressed now; all others have theirs as it is at rest. */
export interface Skin {
  kind: "skin";
  people: SkinRow[];
}

export class PressedSkin {
  private readonly place: BufferAttribute;
  private readonly normal: BufferAttribute;
  private readonly atRest: { place: Float32Array; normal: Float32Array };
  private pressed = new Uint32Array();

  /** mesh: of the figure's file, whose first mesh is its skin. */
  constructor(private readonly mesh: SkinnedMesh) {
    const { position, normal } = mesh.geometry.attributes;
    this.place = position as BufferAttribute;
    this.normal = normal as BufferAttribute;
    this.atRest = { place: Float32Array.from(this.place.array), normal: Float32Array.from(this.normal.array) };
  }

  /** The pressed corners, and where each is in the room [m]. */
  places(): [corner: number, x: number, y: number, z: number][] {
    const place = (corner: number) => this.mesh.localToWorld(this.mesh.getVertexPosition(corner, new Vector3()));
    return [...this.pressed].map((corner) => [corner, ...place(corner).toArray()]);
  }

  /** null: nothing presses any more. */
  press(row: SkinRow | null): void {
    if (!row && !this.pressed.length) return;
    const { place, normal } = this.atRest;
    for (const corner of this.pressed)
      for (let at = 3 * corner; at < 3 * corner + 3; at++) {
        this.place.array[at] = place[at]!;
        this.normal.array[at] = normal[at]!;
      }
    this.pressed = row ? new Uint32Array(bytes(row.corners)) : new Uint32Array();
    if (row) {
      const [offsets, normals] = [new Int8Array(bytes(row.offsets)), new Int8Array(bytes(row.normals))];
      this.pressed.forEach((corner, n) => {
        for (let axis = 0; axis < 3; axis++) {
          this.place.array[3 * corner + axis] = place[3 * corner + axis]! + row.step_m * offsets[3 * n + axis]!;
          this.normal.array[3 * corner + axis] = normals[3 * n + axis]! / 127;
        }
      });
    }
    this.place.needsUpdate = this.normal.needsUpdate = true;
  }
}

function bytes(base64: string): ArrayBuffer {
  return Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0)).buffer;
}
