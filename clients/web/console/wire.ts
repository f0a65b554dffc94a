// What the gateway sends (vistel/render/frames.py says how): words as JSON, frames as bytes.
import type { Dents } from "./dents";
import type { Lanes, Playhead } from "./lanes";
import type { Skin } from "./figures/skin";

export interface Joints {
  kind: "joints";
  names: string[];
  parents: number[];
  body: number[];
  fingers: number[];
  shifted: number[];
  shift_m: number;
  face: string[];
}
export interface PersonRow {
  name: string;
  shown: string;
  site: string;
  rest: [number, number, number][]; // of each joint in its parent's frame [m]
  file: string | null;
}
export interface ThingRow {
  id: string;
  name: string;
  shape: string;
  mass_kg: number;
  file: string | null;
  face: Face | null; // of a board
  front: Face | null; // what is read on it: of a board and a panel
  screen: string | null; // the participant whose screen a panel shows while it comes
}
/** Where one writes on a board: its corner, and its edges across and up, in the thing's frame [m]. */
export type Face = [[number, number, number], [number, number, number], [number, number, number]];
export interface StrokeRow {
  number: number;
  board: string;
  by: string; // participant
  id: string; // what they call it
  colour: string;
  width: number; // in units of its grid
  ink: string; // its points, in base64
}
export interface Ink {
  kind: "ink";
  whole: boolean; // all there is
  strokes: StrokeRow[]; // new and changed ones
  gone: number[];
}
export interface Table {
  kind: "table";
  table: number;
  people: PersonRow[];
  things: ThingRow[];
  room: string | null;
}
export interface Held {
  kind: "held";
  grasps: [string, "left" | "right", string][];
  touching: [string, string][];
}
/** What hands feel (vistel/session/felt_forces.py). */
export interface Forces {
  kind: "forces";
  touches: Force[];
}
export interface Force {
  who: string; // participant
  hand: "left" | "right";
  digit: string;
  body: string; // the thing or participant it touches
  at: [number, number, number]; // in the room [m]
  force: [number, number, number]; // on the hand [N]
}
/** Of a figure's file: cone-spheres, in the frames of its joints [m]. */
export interface Primitives {
  joint: number[];
  a: [number, number, number][];
  b: [number, number, number][];
  radiusA: number[];
  radiusB: number[];
}
export interface Site {
  name: string;
  devices: number;
  sending: number;
  draws: boolean;
  voices: string[];
  pictures_per_s?: number;
  frame_ms?: number;
  delay_ms?: number;
  stand_ins?: number;
  silent_s?: number;
  shows?: string[]; // the participants in its pictures
}
export interface PersonNumbers {
  name: string;
  shown: string;
  site: string;
  motions_per_s: number;
  age_ms: number;
  jitter_ms: number;
  delay_ms: number;
  muted: boolean; // by themselves or by the host
}
export interface Service {
  node: string;
  site: string;
  services: string[];
  up_s: number;
  silent_s: number;
  clock_ms?: number;
  uncertainty_ms?: number;
}
export interface Device {
  name: string;
  site: string;
  state: string;
  frames_per_s: number;
  detail: string;
}
/** What of a kind reaches the gateway (vistel/session/going/flows.py). */
export interface Flow {
  site: string; // empty: the world
  flow: "motion" | "voice" | "screen" | "command" | "reports" | "world" | "force" | "answer";
  age_ms: number; // of the newest
  per_s?: number; // messages
  kbit_s?: number;
  lost?: number; // share of those that were sent
}
export interface Numbers {
  kind: "numbers";
  flows: Flow[];
  sites: Site[];
  people: PersonNumbers[];
  services: Service[];
  devices: Device[];
  troubles: string[];
  viewers: number;
}
export interface Hello {
  kind: "hello";
  conference: string;
  recorded?: boolean; // of the live room: it can be gone back in
  steers?: boolean; // of the live room: the page is the host's
  studio?: string; // for the host: where the studios of the server's machine are; "": none run
  log?: string; // the name of the log that is seen in place of the live room
  grows?: boolean; // it is being written, or was cut off
  damage?: string[];
  path?: string; // of the log, on the server's machine
  people?: string[];
  beside?: string; // the name of the log that is seen with it,
  offset?: number; // and by how much the same moment is later there [s]
}
/** A number over time: values at moments; null: not known. */
export interface Curve {
  name: string;
  unit: string;
  t: number[];
  v: (number | null)[];
}
export interface Plot {
  kind: "plot";
  id: number;
  done: number; // share that has been read
  curves?: Curve[];
  fault?: string;
}
export interface Fields {
  kind: "fields";
  fields: [name: string, unit: string][];
}
export interface Note {
  t: number; // of the log [s]
  author: string;
  text: string;
}
export interface Notes {
  kind: "notes";
  notes: Note[];
  faults: string[];
}
/** A note has gone into the log of the live room. */
export interface Noted {
  kind: "noted";
  text: string;
}
/** Words about the log that is seen beside the first one. */
export interface Beside {
  kind: "beside";
  said: Words;
}
export interface Invited {
  kind: "invited";
  participant: string;
  name: string;
  avatar: string;
  people: string[]; // the built-in people
  seat: [number, number, number, number]; // on the floor [m], and its heading [rad]
}
export interface Heard {
  kind: "heard"; // what a guest's page has asked, up to the n-th
  n: number;
}
export interface Shown {
  kind: "shown"; // what has become of what a guest asked of their panel
  done: boolean;
  reason: string;
  panels: number;
  live?: boolean; // it was a panel for what they show live
}
export interface ProcessRow {
  name: string;
  state: "running" | "starting" | "stopped" | "ending";
  restarts: number;
}
export interface FaultRow {
  name: string;
  about: string;
  seconds: number; // how long it lasts; 0: it happens in a moment
  amount: number;
  unit: string;
  targets: string[];
}
export interface SeatRow {
  name: string;
  shown: string; // as everybody sees the name
  site: string;
  guest: boolean; // of a seat for guests
  invited: string; // the guest's name; empty: nobody
  speaks: boolean; // has a microphone
}
/** What the host can steer. */
export interface Steering {
  kind: "steering";
  runs: boolean; // whether a `vistel up` answers
  processes: ProcessRow[];
  faults: FaultRow[];
  people: SeatRow[];
  nodes: string[]; // whose log lines there are
  worlds: { place: string; leads: boolean }[]; // the leader first
}
/** What became of an action. */
export interface Steered {
  kind: "steered";
  id: number;
  done: boolean;
  answer: string;
  token: string; // of a guest's link
  why?: string; // of a refusal: see connection/refusals.ts
  values?: string[];
}
/** How a line can go on. */
export interface Completions {
  kind: "completions";
  line: string;
  words: string[];
  thing: boolean; // the name of a thing can follow
}
/** The newest that the filter lets through. */
export interface LogLines {
  kind: "lines";
  lines: [time: string, level: string, node: string, text: string][];
}
export interface Refused {
  kind: "refused";
  reason: string;
  code: number;
  why?: string; // see connection/refusals.ts
  values?: string[];
}
export interface Time {
  kind: "time";
  asked: number; // as the page said it
  ms: number; // conference time
}
export interface Line {
  id: string;
  who: string; // participant
  ms: number; // when it was written: UTC
  text: string;
  to: string; // the participant to whom alone; empty: to all
}
export interface Chat {
  kind: "chat";
  lines: Line[]; // the newest, the oldest first
}
/** Lines to the guest alone, and those that they have written to one other. */
export interface Private {
  kind: "private";
  lines: Line[]; // the newest, the oldest first
}
export const REACTIONS = ["thumb_up", "clap", "heart", "laugh", "surprise"] as const;
export type Reaction = (typeof REACTIONS)[number];
/** What people say without words. */
export interface Signals {
  kind: "signals";
  raised: [participant: string, byGesture: boolean][]; // hands, in the order in which they were raised
  reactions: [participant: string, reaction: Reaction][];
}
/** What was said to the room, and what it answered. */
export interface Caption {
  who: string; // as people know them
  text: string;
  mark: string;
  reply: string;
}
/** To commands (vistel/session/told_commands.py). */
export interface Answers {
  kind: "answers";
  answers: { id: string; who: string; text: string; done: boolean; reason: string }[]; // the oldest first
}
export interface Captions {
  kind: "captions";
  captions: Caption[]; // the oldest first
}
export type Words = Lanes | Playhead | Plot | Fields | Notes | Noted | Beside | Hello | Joints | Table | Held | Numbers | Invited | Heard | Shown | Refused | Time | Chat | Private | Signals | Captions | Ink | Skin | Dents | Forces | Answers | Steering | Steered | Completions | LogLines;

export interface PersonFrame {
  who: number;
  talks: boolean;
  hips: [number, number, number];
  shifts: Float32Array; // of the shifted joints in their parents' frames [m]
  rotations: Float32Array; // (x, y, z, w) of each joint relative to its parent
  face: Uint8Array; // of 255
}
export interface ThingFrame {
  what: number;
  position: [number, number, number];
  rotation: [number, number, number, number];
}
export interface Frame {
  table: number;
  tMs: number;
  people: PersonFrame[];
  things: ThingFrame[];
}

const FORMAT = 1;
const HEADER_BYTES = 16;
const THING_BYTES = 24;
const ROOT_HALF = Math.SQRT1_2;

/** A frame; null where it is none that this page knows, or was cut off. */
export function decode(data: ArrayBuffer, joints: Joints): Frame | null {
  return decodeAll(data, joints)[0] ?? null;
}

/** The frames of a message: that of the room, and that of the log beside it where there is one; none where one of them is cut off. */
export function decodeAll(data: ArrayBuffer, joints: Joints): Frame[] {
  const view = new DataView(data);
  const frames: Frame[] = [];
  for (let at = 0; at < data.byteLength; ) {
    if (data.byteLength - at < HEADER_BYTES || view.getUint8(at) !== FORMAT) return [];
    const counts = { people: view.getUint16(at + 4, true), things: view.getUint16(at + 6, true) };
    const end = at + HEADER_BYTES + counts.people * personBytes(joints) + counts.things * THING_BYTES;
    if (data.byteLength < end) return [];
    frames.push(frameAt(view, at, counts, joints));
    at = end;
  }
  return frames;
}

function personBytes(joints: Joints): number {
  return 16 + 6 * (joints.shifted.length + joints.body.length) + 4 * joints.fingers.length + joints.face.length;
}

function frameAt(view: DataView, begin: number, counts: { people: number; things: number }, joints: Joints): Frame {
  let at = begin + HEADER_BYTES;
  const people: PersonFrame[] = [];
  for (let n = 0; n < counts.people; n++, at += personBytes(joints)) people.push(personAt(view, at, joints));
  const things: ThingFrame[] = [];
  for (let n = 0; n < counts.things; n++, at += THING_BYTES) {
    const unit = (k: number) => view.getInt16(at + 16 + 2 * k, true) / 32767;
    things.push({
      what: view.getUint16(at, true),
      position: [view.getFloat32(at + 4, true), view.getFloat32(at + 8, true), view.getFloat32(at + 12, true)],
      rotation: [unit(0), unit(1), unit(2), unit(3)],
    });
  }
  return { table: view.getUint16(begin + 2, true), tMs: view.getFloat64(begin + 8, true), people, things };
}

function personAt(view: DataView, begin: number, joints: Joints): PersonFrame {
  const shifts = new Float32Array(3 * joints.shifted.length);
  const rotations = new Float32Array(4 * joints.names.length);
  let at = begin + 16;
  for (let k = 0; k < shifts.length; k++, at += 2) shifts[k] = view.getInt16(at, true) * joints.shift_m;
  for (const joint of joints.body) {
    const [a, b, c] = [view.getUint16(at, true), view.getUint16(at + 2, true), view.getUint16(at + 4, true)];
    put(rotations, joint, (a >> 15) | ((b >> 15) << 1), [a & 32767, b & 32767, c & 32767], 32767);
    at += 6;
  }
  for (const joint of joints.fingers) {
    const word = view.getUint32(at, true);
    put(rotations, joint, word >>> 30, [(word >>> 20) & 1023, (word >>> 10) & 1023, word & 1023], 1023);
    at += 4;
  }
  return {
    who: view.getUint16(begin, true),
    talks: view.getUint8(begin + 2) !== 0,
    hips: [view.getFloat32(begin + 4, true), view.getFloat32(begin + 8, true), view.getFloat32(begin + 12, true)],
    shifts,
    rotations,
    face: new Uint8Array(view.buffer, view.byteOffset + at, joints.face.length),
  };
}

/** The quaternion of a joint from its three smaller components. */
function put(into: Float32Array, joint: number, missing: number, three: [number, number, number], most: number): void {
  let rest = 1;
  let n = 0;
  for (let k = 0; k < 4; k++) {
    if (k === missing) continue;
    const value = ((three[n++] ?? 0) * 2 - most) / most * ROOT_HALF;
    into[4 * joint + k] = value;
    rest -= value * value;
  }
  into[4 * joint + missing] = Math.sqrt(Math.max(0, rest));
}
