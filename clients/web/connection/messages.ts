// What a page and its worker say to each other.
import type { Words } from "../console/wire";

export type ToWorker =
  | { kind: "open"; address: string; first: string | undefined } // first: what is said first, each time
  | { kind: "send"; data: string | ArrayBuffer }
  | { kind: "seen"; data: ArrayBuffer; at: number } // what a camera saw at a time of day [ms]
  | { kind: "next" } // the last frame has been taken
  | { kind: "look" } // whether the connection still lives
  | { kind: "hear"; hears: boolean } // whether voices are played
  | { kind: "microphone"; port: MessagePort; latencyMs: number } // whence blocks of it come
  | { kind: "speak"; speaks: boolean };

export type FromWorker =
  | { kind: "words"; words: Words }
  | { kind: "frame"; data: ArrayBuffer }
  | { kind: "screen"; data: ArrayBuffer } // a picture of what somebody shows live
  | { kind: "trouble"; text: string | null } // why nothing comes; null: it does
  | { kind: "talker"; name: string; port: MessagePort } // where the voice of somebody comes out
  | { kind: "silent"; name: string } // nothing has come of it for long
  | { kind: "spoken"; level: number; bytes: number } // of the microphone: root mean square now, bytes sent in all
  | { kind: "speechless" }; // the encoder gave up

/** Decoded, of one voice: 20 ms. */
export interface Sounding {
  capturedMs: number; // conference time of the first sample
  delayMs: number; // from capture to the newest frame of the room
  samples: Float32Array<ArrayBuffer>;
}

/** Of a microphone. */
export interface Block {
  end: number; // the time of its AudioContext at the block's end [s]
  block: Float32Array<ArrayBuffer>;
}
