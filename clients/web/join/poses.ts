// From what a headset measures to a record as vistel/protocol/pages/headset.py describes it. Places [m] and rotations are in the seat's
// frame. What that file refuses is left out here: a headset that loses its way must not cost the guest the visit.
export interface Pose {
  place: number[]; // x, y, z
  turn: number[]; // x, y, z, w
  confidence: number; // 0 to 1
}
export interface Controller extends Pose {
  trigger: number; // 0 to 1
  squeeze: number;
}
export interface Joints {
  joints: number[][]; // 25 places in WebXR's order
  confidence: number;
}
export type Measured = Controller | Joints | null;

export const JOINTS = 25;
const KIND = 9;
const HEAD_BYTES = 12;
const POSE_BYTES = 15;
const BUTTONS_BYTES = 2;
const WRIST_BYTES = 7;
const UNITS = 1e4; // of a place in a metre
const TURN = 32767; // of a rotation in 1
const STEP_UNITS = 7; // of the step from one joint to the next
const FARTHEST_M = 1.59;
const HIGHEST_M = 2.19;
const REACH_M = 1.39; // from the eyes to a hand
const SMALLEST_M = 0.031; // from the wrist to the knuckle of the middle finger
const LARGEST_M = 0.29; // from the wrist to any joint
const UNEVEN = 0.009; // of a rotation's length
const KNUCKLE = 11;

/** The record; its time is filled in by who knows conference time. head: midway between the eyes; null: not worn. */
export function record(head: Pose | null, left: Measured, right: Measured): ArrayBuffer {
  const worn = head && sits(head.place) && turns(head.turn) ? head : null;
  const hands = worn ? [left, right].map((hand) => (hand && possible(hand, worn) ? hand : null)) : [];
  const sizes = hands.map((hand) => (!hand ? 0 : "joints" in hand ? WRIST_BYTES + 3 * (JOINTS - 1) : POSE_BYTES + BUTTONS_BYTES));
  const data = new DataView(new ArrayBuffer(HEAD_BYTES + (worn ? POSE_BYTES : 0) + sizes.reduce((sum, n) => sum + n, 0)));
  const flags = (worn ? 1 : 0) + hands.reduce((sum, hand, n) => sum + (hand ? 2 << n : 0) + (hand && "joints" in hand ? 8 << n : 0), 0);
  [0x56, 0x50, KIND, flags].forEach((byte, n) => data.setUint8(n, byte));
  let at = HEAD_BYTES;
  if (worn) at = putPose(data, at, worn);
  for (const hand of hands) {
    if (!hand) continue;
    if ("joints" in hand) {
      at = putJoints(data, at, hand);
      continue;
    }
    at = putPose(data, at, hand);
    for (const pressed of [hand.trigger, hand.squeeze]) data.setUint8(at++, share(pressed));
  }
  return data.buffer;
}

function possible(hand: Controller | Joints, head: Pose): boolean {
  if (!("joints" in hand)) return sits(hand.place) && turns(hand.turn) && apart(hand.place, head.place) <= REACH_M;
  const [wrist] = hand.joints;
  if (hand.joints.length !== JOINTS || !wrist || !sits(wrist) || apart(wrist, head.place) > REACH_M) return false;
  const away = hand.joints.map((joint) => apart(joint, wrist));
  return away[KNUCKLE]! >= SMALLEST_M && away.every((length) => length <= LARGEST_M);
}

/** Whether a place is about the seat: of no number at all it is not. */
function sits([x, y, z]: number[]): boolean {
  return Math.abs(x!) <= FARTHEST_M && Math.abs(z!) <= FARTHEST_M && y! >= 0 && y! <= HIGHEST_M;
}

function turns(turn: number[]): boolean {
  return Math.abs(Math.hypot(...turn) - 1) <= UNEVEN;
}

function apart(a: number[], b: number[]): number {
  return Math.hypot(a[0]! - b[0]!, a[1]! - b[1]!, a[2]! - b[2]!);
}

function share(x: number): number {
  return Math.round(255 * Math.min(1, Math.max(0, x)));
}

function putPose(data: DataView, from: number, { place, turn, confidence }: Pose): number {
  data.setUint8(from, share(confidence));
  const most = Math.max(1, Math.hypot(...turn));
  [...place.map((x) => x * UNITS), ...turn.map((x) => (x / most) * TURN)].forEach((x, n) => data.setInt16(from + 1 + 2 * n, Math.round(x), true));
  return from + POSE_BYTES;
}

/** Each joint from where the one before it will be read, so that no error adds up. */
function putJoints(data: DataView, from: number, { joints, confidence }: Joints): number {
  const read = joints.map((place) => place.map((x) => Math.round(x * UNITS)));
  data.setUint8(from, share(confidence));
  read[0]!.forEach((x, axis) => data.setInt16(from + 1 + 2 * axis, x, true));
  let at = from + WRIST_BYTES;
  for (let n = 1; n < JOINTS; n++) {
    const before = read[parentOf(n)]!;
    const steps = read[n]!.map((x, axis) => Math.min(127, Math.max(-128, Math.round((x - before[axis]!) / STEP_UNITS))));
    read[n] = before.map((x, axis) => x + steps[axis]! * STEP_UNITS);
    for (const step of steps) data.setInt8(at++, step);
  }
  return at;
}

/** The joint before one: of the first of every finger the wrist. */
export function parentOf(joint: number): number {
  return joint === 1 || joint % 5 === 0 ? 0 : joint - 1;
}
