// What this page says of its guest: a record as vistel/protocol/pages/pointer.py describes it.
export interface Pointed {
  palm: [number, number, number]; // in the seat's frame [m]
  turn: number | null; // of what is to lie across the palm, about +Y [rad]
  close: boolean;
}
export interface Doing {
  yaw: number; // where the head looks, from where the seat faces, left positive [rad]
  pitch: number; // up positive [rad]
  left: Pointed | null;
  right: Pointed | null;
  gesture: number;
  number: number; // counts gestures
}
export const MOST_YAW = (115 * Math.PI) / 180; // [rad]; farther nobody can look, and it is refused
export const MOST_PITCH = (75 * Math.PI) / 180;
const FARTHEST_MM = 1590;
const HIGHEST_MM = 2190;
const BYTES = 26;
const ANGLES = 1e4; // units in a radian
const NO_TURN = -32768;

export function record(doing: Doing): ArrayBuffer {
  const data = new DataView(new ArrayBuffer(BYTES));
  const hands = [doing.left, doing.right];
  const flags = hands.reduce((sum, hand, n) => sum + (hand ? 1 << n : 0) + (hand?.close ? 4 << n : 0), 0);
  [0x56, 0x50, 1, flags, doing.gesture, doing.number & 255].forEach((byte, n) => data.setUint8(n, byte));
  data.setInt16(6, Math.round(within(doing.yaw, MOST_YAW) * ANGLES), true);
  data.setInt16(8, Math.round(within(doing.pitch, MOST_PITCH) * ANGLES), true);
  hands.forEach((hand, n) => {
    const [x, y, z] = (hand?.palm ?? [0, 0, 0]).map((length) => Math.round(length * 1000)) as [number, number, number];
    const at = 10 + 8 * n;
    data.setInt16(at, within(x, FARTHEST_MM), true);
    data.setInt16(at + 2, Math.min(HIGHEST_MM, Math.max(0, y)), true);
    data.setInt16(at + 4, within(z, FARTHEST_MM), true);
    data.setInt16(at + 6, hand?.turn == null ? NO_TURN : Math.round(within(hand.turn, Math.PI) * ANGLES), true);
  });
  return data.buffer;
}

function within(x: number, most: number): number {
  return Math.min(most, Math.max(-most, x));
}
