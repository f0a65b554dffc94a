// Voices of the room, from what the gateway sends (vistel/audio/forwarded_voices.py) to samples for the thread that plays them.
import type { Sounding } from "./messages";

const RATE = 48_000;
const HEAD_BYTES = 16;
const MOST_MS = Number.MAX_SAFE_INTEGER / 1000; // of a time, which the decoder takes in microseconds
const KEPT_MS = 20_000; // of silence, after which a talker is forgotten

/** A packet of somebody's voice. */
export interface VoiceRecord {
  name: string;
  capturedMs: number; // conference time
  delayMs: number;
  packet: Uint8Array<ArrayBuffer>;
}

/** The records of a message of voices, up to the first that cannot be one: behind it, nothing can be found. */
export function* recordsOf(data: ArrayBuffer): Generator<VoiceRecord> {
  const view = new DataView(data);
  const names = new TextDecoder();
  for (let at = 1; at + HEAD_BYTES <= data.byteLength; ) {
    const [size, named] = [view.getUint16(at, true), view.getUint8(at + 2)];
    const [capturedMs, delayMs] = [view.getFloat64(at + 4, true), view.getFloat32(at + 12, true)];
    const whole = size > HEAD_BYTES + named && at + size <= data.byteLength;
    if (!whole || !(Math.abs(capturedMs) <= MOST_MS) || !Number.isFinite(delayMs)) return;
    const name = names.decode(new Uint8Array(data, at + HEAD_BYTES, named));
    yield { name, capturedMs, delayMs, packet: new Uint8Array(data, at + HEAD_BYTES + named, size - HEAD_BYTES - named) };
    at += size;
  }
}

interface Talker {
  decoder: AudioDecoder;
  delayMs: number;
  heardAt: number; // of `performance` [ms]
}

export class Hearing {
  private on = false;
  private readonly talkers = new Map<string, Talker>();

  /** came: somebody's voice begins to come out of a port; went: nothing comes any more. */
  constructor(
    private readonly came: (name: string, port: MessagePort) => void,
    private readonly went: (name: string) => void,
  ) {
    setInterval(() => this.forget((talker) => performance.now() - talker.heardAt > KEPT_MS), KEPT_MS / 4);
  }

  turn(on: boolean): void {
    this.on = on;
    if (!on) this.forget(() => true);
  }

  /** A message of voices. */
  take(data: ArrayBuffer): void {
    if (!this.on) return;
    for (const { name, capturedMs, delayMs, packet } of recordsOf(data)) {
      const talker = this.talkers.get(name) ?? this.begin(name);
      talker.delayMs = delayMs;
      talker.heardAt = performance.now();
      const timestamp = Math.round(capturedMs * 1000);
      if (talker.decoder.state === "configured") talker.decoder.decode(new EncodedAudioChunk({ type: "key", timestamp, data: packet }));
    }
  }

  private begin(name: string): Talker {
    const { port1, port2 } = new MessageChannel();
    const decoder = new AudioDecoder({ output: (data) => put(data), error: () => this.forget((t) => t === talker) });
    const talker: Talker = { decoder, delayMs: 0, heardAt: 0 };
    const put = (data: AudioData) => {
      const samples = new Float32Array(data.numberOfFrames);
      data.copyTo(samples, { planeIndex: 0, format: "f32-planar" });
      const sounding: Sounding = { capturedMs: data.timestamp / 1000, delayMs: talker.delayMs, samples };
      data.close();
      port1.postMessage(sounding, [samples.buffer]);
    };
    decoder.configure({ codec: "opus", sampleRate: RATE, numberOfChannels: 1 });
    this.talkers.set(name, talker);
    this.came(name, port2);
    return talker;
  }

  private forget(which: (talker: Talker) => boolean): void {
    for (const [name, talker] of this.talkers) {
      if (!which(talker)) continue;
      if (talker.decoder.state !== "closed") talker.decoder.close();
      this.talkers.delete(name);
      this.went(name);
    }
  }
}
