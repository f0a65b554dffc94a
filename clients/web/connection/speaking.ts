// The guest's voice: from blocks of the microphone to Opus packets with the conference time of their capture.
import type { Block } from "./messages";

const RATE = 48_000;
const FRAME = 960;
const FRAME_MS = 20;
const BITRATE = 24_000;
const LOOKAHEAD_MS = 6.5; // by which Opus delays: the first decoded sample is so much earlier than the first of its frame
const JUMP_MS = 100; // samples are missing: time goes on without them
const SLEW = 0.005; // the most by which time goes faster or slower than samples, for smaller errors
const HEAD_BYTES = 12;
const VOICE = 4; // vistel/audio/page_voice.py
const FLOOR = 1e-5; // root mean square of a microphone that gives nothing

export class Speaking {
  on = false;
  private port: MessagePort | null = null;
  private encoder: AudioEncoder | null = null;
  private latencyMs = 0;
  private level = 0;
  private bytes = 0;
  private readonly waiting = new Float32Array(FRAME);
  private filled = 0;
  private frame = 0; // number of the next; times are counted in samples, as the encoder wants them
  private anchor: number | null = null; // time of `performance` at which frame 0 would have begun [ms]
  private toPerformance = Infinity; // from the context's time [ms]

  /** timeAt: conference time [ms] at a time of `performance`; null: not known. told: how loud it is, and bytes sent in all. */
  constructor(
    private readonly timeAt: (ms: number) => number | null,
    private readonly send: (record: ArrayBuffer) => void,
    private readonly told: (level: number, bytes: number) => void,
    private readonly lost: () => void,
  ) {}

  /** Take what comes from a port, `latencyMs` after it was captured, in place of what came before. */
  begin(port: MessagePort, latencyMs: number): void {
    this.end();
    this.latencyMs = latencyMs;
    this.port = port;
    port.onmessage = ({ data }: MessageEvent<Block>) => this.take(data);
    this.encoder = new AudioEncoder({ output: (chunk) => this.put(chunk), error: () => (this.end(), this.lost()) });
    const opus = { application: "voip", frameDuration: FRAME_MS * 1000, usedtx: true, complexity: 5 };
    this.encoder.configure({ codec: "opus", sampleRate: RATE, numberOfChannels: 1, bitrate: BITRATE, opus } as AudioEncoderConfig);
  }

  private end(): void {
    this.port?.close();
    if (this.encoder && this.encoder.state !== "closed") this.encoder.close();
    this.port = this.encoder = this.anchor = null;
    [this.filled, this.frame, this.toPerformance] = [0, 0, Infinity];
  }

  private take({ end, block }: Block): void {
    // A message is never early: the least of its delays counts, and rises slowly, for clocks that drift.
    this.toPerformance = Math.min(this.toPerformance + 0.001, performance.now() - end * 1000);
    const begin = end * 1000 + this.toPerformance - this.latencyMs - (block.length / RATE) * 1000;
    const counted = this.anchor === null ? Infinity : begin - (this.anchor + this.frame * FRAME_MS + (this.filled / RATE) * 1000);
    if (Math.abs(counted) > JUMP_MS) {
      this.anchor = begin - this.frame * FRAME_MS;
      this.filled = 0;
    } else {
      const most = (SLEW * block.length * 1000) / RATE;
      this.anchor! += Math.max(-most, Math.min(most, counted));
    }
    this.level = Math.sqrt(block.reduce((sum, x) => sum + x * x, 0) / block.length);
    for (let at = 0; at < block.length; ) {
      const count = Math.min(block.length - at, FRAME - this.filled);
      this.waiting.set(block.subarray(at, at + count), this.filled);
      at += count;
      this.filled += count;
      if (this.filled === FRAME) this.encode();
    }
  }

  private encode(): void {
    this.filled = 0;
    const timestamp = this.frame++ * FRAME_MS * 1000;
    this.told(this.level, this.bytes);
    if (!this.on || this.level < FLOOR || this.encoder?.state !== "configured") return;
    const data = new AudioData({ format: "f32-planar", sampleRate: RATE, numberOfFrames: FRAME, numberOfChannels: 1, timestamp, data: this.waiting });
    this.encoder.encode(data);
    data.close();
  }

  private put(chunk: EncodedAudioChunk): void {
    const time = this.anchor === null ? null : this.timeAt(this.anchor + chunk.timestamp / 1000 - LOOKAHEAD_MS);
    if (time === null || !this.on) return;
    const data = new ArrayBuffer(HEAD_BYTES + chunk.byteLength);
    const view = new DataView(data);
    [0x56, 0x50, VOICE, 0].forEach((byte, n) => view.setUint8(n, byte));
    view.setFloat64(4, time, true);
    chunk.copyTo(new Uint8Array(data, HEAD_BYTES));
    this.bytes += data.byteLength;
    this.send(data);
  }
}
