// Dark plates with text inside a headset, where the page's own text is not seen.
import { CanvasTexture, Mesh, MeshBasicMaterial, PlaneGeometry, SRGBColorSpace } from "three";

export const PX_IN_M = 1 / 1100; // at 1.5 m and nearer: a letter is then as high as one of a book held in the hand
const WIDE_PX = 520; // where lines are broken
const LETTER_PX = 44;
const SMALL_PX = 36;
const MARGIN_PX = 18;
const SPACING = 1.25; // from line to line, in heights of a letter
const FONT = "system-ui, sans-serif";

/** A text of a plate. most: lines that it may have. */
export interface Part {
  text: string;
  large: boolean;
  colour: string;
  most: number;
}

interface Row {
  text: string;
  px: number;
  colour: string;
}

export type Plate = Mesh<PlaneGeometry, MeshBasicMaterial>;

/** A plate with nothing on it yet. */
export function plate(): Plate {
  return new Mesh(new PlaneGeometry(), new MeshBasicMaterial({ transparent: true, toneMapped: false, depthWrite: false }));
}

/** Write texts on a plate, one below the other; edge: colour of its edge, or none. */
export function write(on: Plate, parts: Part[], edge: string): void {
  on.material.map?.dispose();
  on.material.map = picture(parts, edge);
  on.material.needsUpdate = true;
}

/** How large a plate is [m]. grown: as many times. */
export function grow(on: Plate, grown: number): void {
  const { width, height } = on.material.map!.image as HTMLCanvasElement;
  on.scale.set(width * PX_IN_M * grown, height * PX_IN_M * grown, 1);
}

function picture(parts: Part[], edge: string): CanvasTexture {
  const canvas = document.createElement("canvas");
  const pen = canvas.getContext("2d")!;
  const rows: Row[] = parts.flatMap(({ text, large, colour, most }) => {
    const px = large ? LETTER_PX : SMALL_PX;
    return broken(pen, text, px, most).map((line) => ({ text: line, px, colour }));
  });
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
