// What the page edits, as the server sends it (vistel.wrinkle.wrinkle_sets, every key said).

export type Vec = [number, number];
export type End = "round" | "taper" | "vanish";

/** A control point: place in the shape's unit, attributes in parts of the wrinkle's. */
export interface Point {
  at: Vec;
  intensity: number;
  thickness: number;
}

export interface Branch {
  points: Point[];
  start: End;
  end: End;
  cap: number;
}

export interface Layer {
  intensity: number;
  offset: number;
  thickness: number;
  lean: number;
}

export interface Shape {
  name: string;
  about: string;
  material: "cloth" | "skin";
  profile: Layer[];
  branches: Branch[];
}

/** One wrinkle; `at` in parts of the plane, lengths in metres of somebody 1.75 m tall, `turn` in degrees. */
export interface Wrinkle {
  shape: string;
  at: Vec;
  size: number | Vec;
  thickness: number;
  intensity: number;
  turn: number;
  mirrored: boolean;
  wrinkledness: number;
  seed: number;
}

export interface Drive {
  joint: string | null;
  axis: [number, number, number] | null;
  action: string | null;
  curve: { knots: Vec[]; form: "linear" | "smooth" };
}

export interface WrinkleSet {
  name: string;
  region: string;
  material: "cloth" | "skin";
  drive: Drive;
  wrinkles: Wrinkle[];
  pull: Vec[];
  lift: number;
  memory: number;
  mouth: boolean;
}

/** How the texture lies on an island (vistel.figure.avatar.avatar.Registration): parts of the texture, radians, factor. */
export interface Lying {
  island: number;
  move: Vec;
  turn: number;
  scale: number;
}

/** A place of an island's own coordinates, and where on the picture it belongs. */
export interface Pin {
  island: number;
  from: Vec;
  to: Vec;
}

/** base: which of the avatars the server has, one more for each photograph that was brought. */
export interface Form {
  shapes: Shape[];
  sets: WrinkleSet[];
  texture: Lying[];
  pins: Pin[];
  base: number;
}

/** A region; planes: width and height [m] by side ("left_", "right_" or ""); knots: joints and their v. */
export interface Region {
  name: string;
  sides: boolean;
  planes: Record<string, Vec>;
  knots: [string, number][];
}

export interface Bend {
  name: string;
  label: string;
  group: string;
  low: number;
  high: number;
  start: number;
  unit: string;
  action: string;
}

export interface Fault {
  text: string;
  set: number | null;
  shape: string | null;
}

/** Control points that wrinkledness moved, in the shape's unit. */
export interface Jitter {
  set: number;
  wrinkle: number;
  branches: Vec[][];
}

export interface Opened {
  session: string;
  revision: string;
  name: string;
  source: string;
  saves: string;
  readable: string;
  form: Form;
  height: number;
  regions: Region[];
  shapes: Record<string, Shape>;
  bends: Bend[];
  joints: string[];
  actions: string[];
  albedo: Vec;
}

export interface SetState {
  set: number;
  side: string;
  weight: number;
  driven: number;
}

export interface Updated {
  faults: Fault[];
  bends: Record<string, number>;
  sets: SetState[];
  light: { version: number; size?: Vec; rect?: [number, number, number, number] };
  plane?: { set: number; side: string };
  planeSize?: Vec;
  focus?: { middle: [number, number, number]; facing: [number, number, number]; radius: number };
  jitters?: Jitter[];
  albedo?: Vec;
}
