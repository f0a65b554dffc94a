// From what Holistic finds in a picture to a record as vistel/protocol/pages/camera_body.py describes it, and to what is told of the picture.
export interface Landmark {
  x: number; // share of the picture's width, from its left
  y: number; // of its height, from its top
  z: number; // nearer is negative, in widths; of the body's world landmarks in metres, from the hips
  visibility?: number;
}
export interface Found {
  body?: Landmark[];
  world?: Landmark[]; // the same points in metres
  left?: Landmark[];
  right?: Landmark[];
  face?: Landmark[];
}
/** What is wrong with a picture; "": nothing. */
export type Note = "" | "dark" | "nobody" | "half" | "light" | "other" | "hidden";

const BODY = [0, 11, 12, 13, 14, 15, 16, 23, 24];
const FACE = [168, 10, 1, 454, 234, 263, 362, 133, 33, 386, 374, 159, 145, 473, 468, 291, 61, 13, 14, 152, 334, 105];
const [LEFT_SHOULDER, RIGHT_SHOULDER] = [11, 12];
const KIND = 5;
const HEAD_BYTES = 12;
const POINT_BYTES = 6;
const PLACE_BYTES = 6;
const UNITS = 1e4; // of a place, in a picture height
const STEPS = 1e6; // of the size of a step, in a picture height
const MOST_STEP = 8000;
const FARTHEST = 20000;
const CALIBRATING = 16;
const DARK = 14; // mean of a picture's brightness, of 255: nobody can be found in it
const BRIGHT = 150; // of a picture in which somebody is, but no face
const MARGIN = 0.02;
const JUMP = 0.8; // shoulder breadths from one picture to the next within JUMP_MS
const GROWN = 1.5; // times the breadth of the shoulders
const JUMP_MS = 700;

type Point = [number, number, number];

/** The record; its time is filled in by who knows conference time. aspect: width of the picture in its heights. */
export function record(found: Found, aspect: number, calibrating: boolean): ArrayBuffer {
  const { body, world } = found;
  const meshes = body && world ? [found.left, found.right, FACE.map((n) => found.face?.[n]).filter((p) => p !== undefined)] : [];
  const parts = meshes.map((mesh) => (mesh?.length ? mesh.map((p) => placed(p, aspect)) : null));
  const size = HEAD_BYTES + (body && world ? BODY.length * POINT_BYTES : 0) + parts.reduce((sum, p) => sum + (p ? PLACE_BYTES + 3 * p.length : 0), 0);
  const data = new DataView(new ArrayBuffer(size));
  const flags = (body && world ? 1 : 0) + parts.reduce((sum, p, n) => sum + (p ? 2 << n : 0), 0) + (calibrating ? CALIBRATING : 0);
  [0x56, 0x50, KIND, flags].forEach((byte, n) => data.setUint8(n, byte));
  let at = HEAD_BYTES;
  if (body && world) {
    for (const n of BODY) {
      const [x, y] = placed(body[n]!, aspect);
      data.setInt16(at, units(x), true);
      data.setInt16(at + 2, units(y), true);
      data.setInt8(at + 4, Math.max(-128, Math.min(127, Math.round(-100 * world[n]!.z))));
      data.setUint8(at + 5, Math.round(255 * Math.min(1, Math.max(0, body[n]!.visibility ?? 0))));
      at += POINT_BYTES;
    }
  }
  for (const part of parts) at = part ? put(data, at, part) : at;
  return data.buffer;
}

/** A hand or a face: a place, the size of a step, and its points in steps from there. */
function put(data: DataView, from: number, points: Point[]): number {
  const middle = [0, 1].map((axis) => {
    const values = points.map((p) => p[axis]!);
    return units((Math.min(...values) + Math.max(...values)) / 2);
  });
  const away = points.map((p) => [p[0] - middle[0]! / UNITS, p[1] - middle[1]! / UNITS, p[2]]);
  const farthest = Math.max(...away.flat().map(Math.abs));
  const step = Math.min(MOST_STEP, Math.max(1, Math.ceil((farthest / 127) * STEPS)));
  data.setInt16(from, middle[0]!, true);
  data.setInt16(from + 2, middle[1]!, true);
  data.setUint16(from + 4, step, true);
  let at = from + PLACE_BYTES;
  for (const value of away.flat()) data.setInt8(at++, Math.max(-127, Math.min(127, Math.round((value * STEPS) / step))));
  return at;
}

function placed(p: Landmark, aspect: number): Point {
  return [(p.x - 0.5) * aspect, 0.5 - p.y, -p.z * aspect];
}

function units(x: number): number {
  return Math.round(Math.max(-FARTHEST, Math.min(FARTHEST, x * UNITS)));
}

/** Tells what is wrong with the pictures of one camera. */
export class Judge {
  private last: { x: number; y: number; breadth: number; at: number } | null = null;

  /** light: mean brightness of the picture (0 to 255); at: when it was taken [ms]. */
  note(found: Found, aspect: number, light: number, at: number): Note {
    if (light < DARK) return "dark";
    const [left, right] = [found.body?.[LEFT_SHOULDER], found.body?.[RIGHT_SHOULDER]];
    if (!left || !right) return "nobody";
    const breadth = Math.hypot((left.x - right.x) * aspect, left.y - right.y);
    const now = { x: ((left.x + right.x) / 2) * aspect, y: (left.y + right.y) / 2, breadth, at };
    const before = this.last;
    this.last = now;
    if (before && at - before.at < JUMP_MS) {
      const grown = Math.max(breadth / before.breadth, before.breadth / breadth);
      if (Math.hypot(now.x - before.x, now.y - before.y) > JUMP * Math.max(breadth, before.breadth) || grown > GROWN) return "other";
    }
    const outside = [left, right].some((p) => p.x < MARGIN || p.x > 1 - MARGIN || p.y > 1 - MARGIN);
    if (outside) return "half";
    return found.face ? "" : light > BRIGHT ? "light" : "half";
  }
}
