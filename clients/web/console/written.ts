// What is written on boards: ribbons just before their faces, as vistel/space/boards/ribbon.py has them.
import { BufferAttribute, BufferGeometry, Color, Group, Mesh, MeshBasicMaterial, Vector3 } from "three";
import { dispose } from "./dispose";
import type { Face, Ink, StrokeRow, ThingRow } from "./wire";

export const ACROSS = 3600; // units of a face's width, as vistel/space/boards/stroke.py has them
export const UPWARDS = 2400;
const NEAREST_M = 0.0012; // from the face to the lowest stroke
const LAYER_M = 0.00004;
const LAYERS = 50;
const OWN_LAYER = 60; // of what is being written on this page
const BENDS = 0.5; // cosine under which a ribbon ends round at a point, and begins anew
const ROUND = 10;
const TOGETHER = 32; // strokes in one mesh

type Point = [number, number];
export interface Shape {
  points: Point[];
  colour: string;
  width: number;
  layer: number;
}
export interface Board {
  about: ThingRow;
  node: Group;
}

/** The place of points of a face, in its thing's frame [m]. */
export function onFace(face: Face, x: number, y: number, off: number): Vector3 {
  const [corner, across, up] = face.map((edge) => new Vector3(...edge)) as [Vector3, Vector3, Vector3];
  const out = new Vector3().crossVectors(across, up).normalize();
  return corner.addScaledVector(across, x / ACROSS).addScaledVector(up, y / UPWARDS).addScaledVector(out, off);
}

/** Points of ink: two bytes each for the first, then a signed byte for each way on. */
export function pointsOf(ink: string): Point[] {
  const bytes = Uint8Array.from(atob(ink), (letter) => letter.charCodeAt(0));
  const view = new DataView(bytes.buffer);
  let [x, y] = [view.getUint16(0, true), view.getUint16(2, true)];
  const points: Point[] = [[x, y]];
  for (let at = 4; at + 1 < bytes.length; at += 2) {
    x += view.getInt8(at);
    y += view.getInt8(at + 1);
    points.push([x, y]);
  }
  return points;
}

export class Written {
  private readonly strokes = new Map<number, StrokeRow>();
  private readonly pieces = new Map<string, { rows: StrokeRow[]; about: ThingRow; mesh: Mesh }>();
  /** Strokes that are written on this page and have not come back yet, by their ids. */
  private readonly own = new Map<string, { board: string; shape: Shape; mesh: Mesh }>();
  /** Whose strokes those are. */
  writer = "";

  /** changed: called where something else is to be seen. */
  constructor(private readonly changed: () => void) {}

  receive(words: Ink): void {
    if (words.whole) this.strokes.clear();
    for (const number of words.gone) {
      const row = this.strokes.get(number);
      if (row?.by === this.writer) this.forget(row.id); // rubbed out before all of it had come back
      this.strokes.delete(number);
    }
    for (const row of words.strokes) this.strokes.set(row.number, row);
    for (const row of words.strokes) {
      const own = row.by === this.writer && this.own.get(row.id);
      if (own && pointsOf(row.ink).length >= own.shape.points.length) this.forget(row.id);
    }
  }

  /** Draw a stroke of this page until it has come back from the world. */
  draft(id: string, board: string, shape: Shape, about: Board): void {
    this.forget(id);
    const face = about.about.face;
    if (!face) return;
    const mesh = meshOf([{ ...shape, layer: OWN_LAYER }], face);
    this.own.set(id, { board, shape, mesh });
    about.node.add(mesh);
    this.changed();
  }

  /** Something that this page asked for was refused, or undone: what has not come back is not shown as if it were on the board. What is
   * only on its way comes with the world's strokes. */
  forgetDrafts(): void {
    for (const id of [...this.own.keys()]) this.forget(id);
  }

  /** The stroke of this page has come back, or is drawn anew. */
  private forget(id: string): void {
    const own = this.own.get(id);
    if (!own) return;
    dropped(own.mesh);
    this.own.delete(id);
    this.changed();
  }

  /** Put what is new before the boards' faces. */
  show(boards: Map<string, Board>): void {
    const wanted = new Map<string, StrokeRow[]>();
    for (const row of [...this.strokes.values()].sort((a, b) => a.number - b.number)) {
      if (!boards.get(row.board)?.about.face) continue;
      const name = `${row.board} ${Math.floor(row.number / TOGETHER)}`;
      wanted.set(name, [...(wanted.get(name) ?? []), row]);
    }
    for (const [name, piece] of this.pieces) {
      const rows = wanted.get(name);
      const board = rows && boards.get(rows[0]!.board);
      const same = rows && board?.about === piece.about && rows.length === piece.rows.length && rows.every((r, n) => r === piece.rows[n]);
      if (same) continue;
      dropped(piece.mesh);
      this.pieces.delete(name);
    }
    for (const [name, rows] of wanted) {
      const board = boards.get(rows[0]!.board);
      if (this.pieces.has(name) || !board?.about.face) continue;
      const mesh = meshOf(rows.map(shapeOf), board.about.face);
      this.pieces.set(name, { rows, about: board.about, mesh });
      board.node.add(mesh);
    }
  }
}

function shapeOf(row: StrokeRow): Shape {
  return { points: pointsOf(row.ink), colour: row.colour, width: row.width, layer: row.number % LAYERS };
}

function dropped(mesh: Mesh): void {
  mesh.removeFromParent();
  dispose(mesh);
}

function meshOf(shapes: Shape[], face: Face): Mesh {
  const places: number[] = [];
  const colours: number[] = [];
  const triangles: number[] = [];
  for (const { points, colour, width, layer } of shapes) {
    const flat: Point[] = [];
    const begin = places.length / 3;
    for (const run of runs(distinct(points)).map(smooth)) {
      if (run.length > 1) strip(run, width / 2, flat, triangles, begin);
      for (const end of [run[0]!, run[run.length - 1]!]) disc(end, width / 2, flat, triangles, begin);
    }
    const { r, g, b } = new Color(colour);
    for (const [x, y] of flat) {
      places.push(...onFace(face, x, y, NEAREST_M + LAYER_M * layer).toArray());
      colours.push(r, g, b);
    }
  }
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(new Float32Array(places), 3));
  geometry.setAttribute("color", new BufferAttribute(new Float32Array(colours), 3));
  geometry.setIndex(triangles);
  const mesh = new Mesh(geometry, new MeshBasicMaterial({ vertexColors: true, toneMapped: false }));
  mesh.name = INK;
  return mesh;
}

/** What meshes of strokes are called among what a thing shows. */
export const INK = "ink";

function distinct(points: Point[]): Point[] {
  return points.filter(([x, y], n) => n === 0 || x !== points[n - 1]![0] || y !== points[n - 1]![1]);
}

/** Two more points on each way, on the curve through all. */
function smooth(points: Point[]): Point[] {
  if (points.length < 3) return points;
  const out: Point[] = [];
  for (let n = 0; n + 1 < points.length; n++) {
    const [a, b, c, d] = [points[Math.max(0, n - 1)]!, points[n]!, points[n + 1]!, points[Math.min(points.length - 1, n + 2)]!];
    out.push(b);
    for (const t of [1 / 3, 2 / 3]) {
      const at = (k: 0 | 1) =>
        b[k] + 0.5 * t * (c[k] - a[k]) + t * t * (a[k] - 2.5 * b[k] + 2 * c[k] - 0.5 * d[k]) + 0.5 * t ** 3 * (3 * b[k] - a[k] - 3 * c[k] + d[k]);
      out.push([at(0), at(1)]);
    }
  }
  out.push(points[points.length - 1]!);
  return out;
}

function way(a: Point, b: Point): Point {
  const [x, y] = [b[0] - a[0], b[1] - a[1]];
  const long = Math.max(1e-9, Math.hypot(x, y));
  return [x / long, y / long];
}

/** The line cut where it bends sharply; each part begins where the one before ends. */
function runs(points: Point[]): Point[][] {
  const out: Point[][] = [];
  let begin = 0;
  for (let n = 1; n + 1 < points.length; n++) {
    const [before, after] = [way(points[n - 1]!, points[n]!), way(points[n]!, points[n + 1]!)];
    if (before[0] * after[0] + before[1] * after[1] >= BENDS) continue;
    out.push(points.slice(begin, n + 1));
    begin = n;
  }
  return [...out, points.slice(begin)];
}

function strip(run: Point[], half: number, flat: Point[], triangles: number[], begin: number): void {
  const first = begin + flat.length;
  run.forEach(([x, y], n) => {
    const before = way(run[Math.max(0, n - 1)]!, run[Math.max(1, n)]!);
    const after = way(run[Math.min(run.length - 2, n)]!, run[Math.min(run.length - 1, n + 1)]!);
    const along: Point = [before[0] + after[0], before[1] + after[1]];
    const out = (2 * half) / Math.max(1, along[0] ** 2 + along[1] ** 2);
    flat.push([x - along[1] * out, y + along[0] * out], [x + along[1] * out, y - along[0] * out]);
    if (n === 0) return;
    const k = first + 2 * (n - 1);
    triangles.push(k, k + 1, k + 2, k + 1, k + 3, k + 2);
  });
}

function disc([x, y]: Point, half: number, flat: Point[], triangles: number[], begin: number): void {
  const first = begin + flat.length;
  for (let n = 0; n < ROUND; n++) {
    const turn = (n * 2 * Math.PI) / ROUND;
    flat.push([x + half * Math.cos(turn), y + half * Math.sin(turn)]);
    if (n > 1) triangles.push(first, first + n - 1, first + n);
  }
}
