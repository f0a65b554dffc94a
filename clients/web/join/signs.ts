// Names over heads inside a headset, where the page's own text is not seen; under a name what its owner holds, and for a while what they
// have written.
import { CanvasTexture, Group, Mesh, MeshBasicMaterial, PlaneGeometry, SRGBColorSpace, Vector3 } from "three";
import { dispose } from "../console/dispose";
import { labelOf } from "../console/labels";
import type { Room } from "../console/room";
import type { Line } from "../console/wire";

const PX_IN_M = 1 / 1100; // at 1.5 m and nearer: a letter is then as high as one of a book held in the hand
const NEAR_M = 1.5; // from here on signs grow with their distance, so that they stay readable...
const MOST_GROWN = 3; // ... up to here
const WIDE_PX = 520; // where lines are broken
const LETTER_PX = 44;
const SMALL_PX = 36;
const MARGIN_PX = 18;
const SPACING = 1.25; // from line to line, in heights of a letter
const MOST_LINES = 5; // of what somebody has written
const STAYS_MS = 6000; // what was written...
const READING_MS = 70; // ... and so much longer for each letter
const TALKS = "#85cf9b";
const FONT = "system-ui, sans-serif";

interface Row {
  text: string;
  px: number;
  colour: string;
}

interface Sign {
  mesh: Mesh<PlaneGeometry, MeshBasicMaterial>;
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
    for (const { who, text } of fresh) this.written.set(who, { text, untilMs: now + STAYS_MS + READING_MS * text.length });
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
      const { width, height } = sign.mesh.material.map!.image as HTMLCanvasElement;
      sign.mesh.scale.set(width * PX_IN_M * grown, height * PX_IN_M * grown, 1);
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
    const { text, holds, talks } = labelOf(this.room, name);
    const written = this.written.get(name)?.text ?? "";
    const says = [text, holds, written].filter((part) => part).join("\n");
    const edge = talks ? TALKS : "";
    const sign = this.all.get(name) ?? this.added(name);
    if (sign.says === says && sign.edge === edge) return sign;
    Object.assign(sign, { says, edge });
    sign.mesh.material.map?.dispose();
    sign.mesh.material.map = picture(text, holds, written, edge);
    sign.mesh.material.needsUpdate = true;
    return sign;
  }

  private added(name: string): Sign {
    const look = new MeshBasicMaterial({ transparent: true, toneMapped: false, depthWrite: false });
    const sign: Sign = { mesh: new Mesh(new PlaneGeometry(), look), says: "", edge: "" };
    this.add(sign.mesh);
    this.all.set(name, sign);
    return sign;
  }

  private take(mesh: Mesh): void {
    mesh.removeFromParent();
    dispose(mesh);
  }
}

/** A sign: edge: its colour, or none. */
function picture(name: string, holds: string, written: string, edge: string): CanvasTexture {
  const canvas = document.createElement("canvas");
  const pen = canvas.getContext("2d")!;
  const rows: Row[] = [
    ...broken(pen, name, LETTER_PX, 1).map((text) => ({ text, px: LETTER_PX, colour: "#f1f2f4" })),
    ...broken(pen, holds, SMALL_PX, 1).map((text) => ({ text, px: SMALL_PX, colour: "#a9cbf3" })),
    ...broken(pen, written, SMALL_PX, MOST_LINES).map((text) => ({ text, px: SMALL_PX, colour: "#ffffff" })),
  ];
  const width = ({ text, px }: Row) => ((pen.font = `500 ${px}px ${FONT}`), pen.measureText(text).width);
  canvas.width = Math.ceil(Math.max(...rows.map(width)) + 2 * MARGIN_PX);
  canvas.height = Math.ceil(rows.reduce((sum, { px }) => sum + px * SPACING, 0) + MARGIN_PX);
  pen.fillStyle = "rgb(23 25 28 / 78%)";
  pen.beginPath();
  pen.roundRect(3, 3, canvas.width - 6, canvas.height - 6, MARGIN_PX);
  pen.fill();
  if (edge) Object.assign(pen, { strokeStyle: edge, lineWidth: 5 }).stroke();
  pen.textAlign = "center";
  pen.textBaseline = "middle";
  let y = MARGIN_PX / 2;
  for (const { text, px, colour } of rows) {
    Object.assign(pen, { font: `500 ${px}px ${FONT}`, fillStyle: colour });
    pen.fillText(text, canvas.width / 2, y + (px * SPACING) / 2);
    y += px * SPACING;
  }
  const texture = new CanvasTexture(canvas);
  texture.colorSpace = SRGBColorSpace;
  return texture;
}

/** A text in lines that are no wider than a sign may be; what does not fit into `most` of them is left out, which three dots at the end tell. */
function broken(pen: CanvasRenderingContext2D, text: string, px: number, most: number): string[] {
  pen.font = `500 ${px}px ${FONT}`;
  const lines: string[] = [];
  let line = "";
  const wide = (words: string) => pen.measureText(words).width > WIDE_PX;
  for (const { segment } of new Intl.Segmenter(undefined, { granularity: "word" }).segment(text.trim())) {
    for (const part of wide(segment) ? [...segment] : [segment]) {
      if (line && wide(line + part)) {
        lines.push(line.trimEnd());
        line = part.trimStart();
      } else line += part;
    }
  }
  if (line.trim()) lines.push(line.trimEnd());
  if (lines.length <= most) return lines;
  return [...lines.slice(0, most - 1), `${lines[most - 1]!.slice(0, -1)}…`];
}
