// What a guest writes on a board with mouse, pen or finger: seen at once here, and sent in parts while it is written.
import { Raycaster, Vector2, Vector3 } from "three";
import type { Room } from "../console/room";
import { ACROSS, type Board, UPWARDS } from "../console/written";
import { text } from "./words";

export const COLOURS = { black: "#222222", red: "#c23b32", blue: "#2f6db5", green: "#3f9c5a" }; // as vistel/space/commands/names.py has them
export type Tool = keyof typeof COLOURS | "rub";
type Point = [number, number];
type Said =
  | { draw: number[]; board: string; stroke: string; colour: string }
  | { rub: number[]; board: string }
  | { wipe: string }
  | { undo: true }
  | { new_board: true };

const SEND_MS = 150; // from one part of a stroke to the next: the world takes ten commands a second
const APART = 3; // units of the grid from one point to the next, at least
const FURTHEST = 127; // as vistel/space/boards/stroke.py has it: a point for each way so long
const MOST_POINTS = 120; // then the next stroke begins where this one ends
const WIDTH = 12;

interface Stroke {
  id: string;
  board: string;
  points: Point[];
  count: number;
  sent: number;
}

export class Writing {
  tool: Tool | null = null;
  private stroke: Stroke | null = null;
  private number = 0;
  private sentAt = 0;

  constructor(
    private readonly room: Room,
    private readonly who: string,
    private readonly ask: (said: Said) => void,
  ) {
    room.written.writer = who;
  }

  /** Whether there is a board to write on. */
  get boards(): string[] {
    return [...this.room.things].filter(([, { about }]) => about.face).map(([id]) => id);
  }

  /** The pointer was pressed at a place of the canvas (-1 to 1, up). False where nothing can be written. */
  press(x: number, y: number): boolean {
    const found = this.tool && this.room.pick(x, y, this.who)?.thing;
    const point = found ? this.at(found, x, y) : null;
    if (!found || !point) return false;
    this.begin(found, point);
    return true;
  }

  /** The pointer has moved; nothing while it is not pressed. */
  move(x: number, y: number): void {
    const now = this.stroke;
    if (!now) return;
    const point = this.at(now.board, x, y);
    if (!point) return this.release();
    const [lastX, lastY] = now.points[now.points.length - 1]!;
    const far = Math.max(Math.abs(point[0] - lastX), Math.abs(point[1] - lastY));
    if (far < APART) return;
    now.points.push(point);
    now.count += Math.ceil(far / FURTHEST);
    if (now.count > MOST_POINTS) {
      this.release();
      this.begin(now.board, point);
    } else if (performance.now() - this.sentAt > SEND_MS) this.send();
    this.draw();
  }

  release(): void {
    if (!this.stroke) return;
    this.draw();
    this.send();
    this.stroke = null;
  }

  /** Send what is left of a stroke whose pointer rests. To be called often. */
  step(): void {
    if (this.stroke && performance.now() - this.sentAt > SEND_MS) this.send();
  }

  private begin(board: string, point: Point): void {
    this.stroke = { id: `${Date.now().toString(36)} ${this.number++}`, board, points: [point], count: 1, sent: 0 };
    this.sentAt = performance.now();
    this.draw();
  }

  private draw(): void {
    const [now, board] = [this.stroke, this.stroke && this.room.things.get(this.stroke.board)];
    if (!now || !board || this.tool === "rub" || !this.tool) return;
    this.room.written.draft(now.id, now.board, { points: now.points, colour: COLOURS[this.tool], width: WIDTH, layer: 0 }, board);
  }

  private send(): void {
    const now = this.stroke;
    if (!now || !this.tool || now.sent === now.points.length) return;
    const rubs = this.tool === "rub";
    // What rubs begins where it was last; a stroke goes on from there by itself.
    const part = now.points.slice(rubs ? Math.max(0, now.sent - 1) : now.sent).flat();
    this.ask(
      this.tool === "rub"
        ? { rub: part, board: now.board }
        : { draw: part, board: now.board, stroke: now.id, colour: COLOURS[this.tool] },
    );
    now.sent = now.points.length;
    this.sentAt = performance.now();
  }

  /** Where on the face of a board a place of the canvas is; null beside it, and from behind. */
  private at(board: string, x: number, y: number): Point | null {
    const shown: Board | undefined = this.room.things.get(board);
    const face = shown?.about.face;
    if (!face) return null;
    const [corner, across, up] = face.map((edge) => new Vector3(...edge)) as [Vector3, Vector3, Vector3];
    const ray = new Raycaster();
    ray.setFromCamera(new Vector2(x, y), this.room.camera);
    shown.node.updateMatrixWorld(true);
    ray.ray.applyMatrix4(shown.node.matrixWorld.clone().invert());
    const normal = new Vector3().crossVectors(across, up);
    const slope = ray.ray.direction.dot(normal);
    if (slope >= 0) return null;
    const along = corner.clone().sub(ray.ray.origin).dot(normal) / slope;
    const to = ray.ray.at(along, new Vector3()).sub(corner);
    const point: Point = [
      Math.round((to.dot(across) / across.lengthSq()) * ACROSS),
      Math.round((to.dot(up) / up.lengthSq()) * UPWARDS),
    ];
    return point[0] >= 0 && point[0] <= ACROSS && point[1] >= 0 && point[1] <= UPWARDS ? point : null;
  }

  /** Rub out all of the newest board. */
  wipe(): void {
    const newest = this.boards.at(-1);
    this.room.written.forgetDrafts();
    if (newest) this.ask({ wipe: newest });
  }

  undo(): void {
    this.room.written.forgetDrafts();
    this.ask({ undo: true });
  }

  putUp(): void {
    this.ask({ new_board: true });
  }
}

/** Put a board up, where there is none. */
export function BoardChoice({ writing }: { writing: Writing }) {
  if (writing.boards.length > 0) return null;
  return <button type="button" id="new-board" onClick={() => writing.putUp()}>{text("new_board")}</button>;
}

/** With what is written on the board. */
export function WriteButtons({ writing, changed }: { writing: Writing; changed: () => void }) {
  if (writing.boards.length === 0) return null;
  const choose = (tool: Tool) => {
    writing.release();
    writing.tool = writing.tool === tool ? null : tool;
    changed();
  };
  return (
    <span role="group" aria-label={text("write_on")} class="pens">
      {(Object.keys(COLOURS) as (keyof typeof COLOURS)[]).map((name) => (
        <button type="button" key={name} class="pen" aria-pressed={writing.tool === name} aria-label={text(`pen_${name}`)}
          title={text(`pen_${name}`)} onClick={() => choose(name)}>
          <i style={{ background: COLOURS[name] }} />
        </button>
      ))}
      <button type="button" id="rub" aria-pressed={writing.tool === "rub"} onClick={() => choose("rub")}>{text("rub")}</button>
      <button type="button" id="undo-stroke" onClick={() => writing.undo()}>{text("undo")}</button>
      <button type="button" id="wipe" onClick={() => writing.wipe()}>{text("wipe")}</button>
    </span>
  );
}
