// Plays one voice on the browser's thread for sound. The page tells when pictures are seen; a worker sends what was said.
import type { Sounding } from "../connection/messages";
import { CHUNK, Player } from "./player";

declare const currentTime: number;
declare const sampleRate: number;
declare const registerProcessor: (name: string, processor: new () => AudioWorkletProcessor) => void;
declare class AudioWorkletProcessor {
  readonly port: MessagePort;
}

/** From the page. port: where the voice comes from; else see Player. */
export type Told = { port: MessagePort } | { clockMs: number; pictureMs: number | null } | { over: true };
/** To the page, twice a second: samples as Player counts them, and how far behind its picture what is heard is [ms]. */
export interface Played {
  played: number;
  made: number;
  late: number;
  skewMs: number | null;
}
const TELL_S = 0.5;

class Voice extends AudioWorkletProcessor {
  private readonly player = new Player();
  private chunk: Float32Array | null = null;
  private used = CHUNK;
  private toldAt = 0;
  private over = false;

  constructor() {
    super();
    this.port.onmessage = ({ data }: MessageEvent<Told>) => {
      if ("port" in data) data.port.onmessage = ({ data: sounding }: MessageEvent<Sounding>) => this.player.put(sounding, currentTime * 1000);
      else if ("over" in data) this.over = true;
      else Object.assign(this.player, data);
    };
  }

  process(_: unknown, [outputs]: Float32Array[][]): boolean {
    const out = outputs![0]!;
    for (let at = 0; at < out.length; ) {
      if (this.used === CHUNK) {
        this.chunk = this.player.next((currentTime + at / sampleRate) * 1000);
        this.used = 0;
      }
      const count = Math.min(out.length - at, CHUNK - this.used);
      if (this.chunk) out.set(this.chunk.subarray(this.used, this.used + count), at);
      at += count;
      this.used += count;
    }
    if (currentTime - this.toldAt > TELL_S) {
      this.toldAt = currentTime;
      this.port.postMessage({ ...this.player.counts, skewMs: this.player.skewMs((currentTime + out.length / sampleRate) * 1000 - this.used / 48) } satisfies Played);
    }
    return !this.over;
  }
}
registerProcessor("voice", Voice);
