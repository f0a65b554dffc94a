// What the renderer's stream says (services/vistel_services/renderer/out/stream.py).

export const HEAD_BYTES = 16;
export const PICTURE = 0;
export const KEY_PICTURE = 1;
export const SOUND = 2;

export interface Hello {
  kind: "hello";
  site: string;
  width: number;
  height: number;
  sound: boolean;
}

export interface State {
  kind: "state";
  rate: number;
  /** How long before the picture was drawn the motions in it were captured. */
  motion_age_ms: number;
  readers: number;
  left_out: number;
}

export interface Pong {
  kind: "pong";
  ping: number;
  t_ms: number;
}

export type Words = Hello | State | Pong;

/** A picture or sound; tUs: conference time [us]. */
export interface Packet {
  kind: number;
  tUs: number;
  data: Uint8Array;
}

export function packetOf(message: ArrayBuffer): Packet {
  const view = new DataView(message);
  return { kind: view.getUint8(0), tUs: Number(view.getBigUint64(8, true)), data: new Uint8Array(message, HEAD_BYTES) };
}
