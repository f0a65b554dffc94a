// Voices in step with the pictures: a packet is heard when the picture of its time is seen.
import type { Packet } from "./messages";

const RATE = 48_000;
const AHEAD_S = 0.03; // against what comes unevenly
const JUMP_S = 0.04; // less than this off its time, a packet is put to the end of the one before
const MOST_WAIT_S = 1.0;

export const canHear = "AudioDecoder" in window;

export class Sound {
  private readonly context = new AudioContext({ sampleRate: RATE, latencyHint: "interactive" });
  private readonly decoder: AudioDecoder;
  private next = 0;
  private late = 0;

  /** now: conference time [ms]; pictureAge: of the picture that is seen now [s]. */
  constructor(
    private readonly now: () => number,
    private readonly pictureAge: () => number,
  ) {
    this.decoder = new AudioDecoder({ output: (data) => this.play(data), error: () => undefined });
    this.decoder.configure({ codec: "opus", sampleRate: RATE, numberOfChannels: 2 });
  }

  put(packet: Packet): void {
    if (this.decoder.state !== "configured") return;
    this.decoder.decode(new EncodedAudioChunk({ type: "key", timestamp: packet.tUs, data: packet.data }));
  }

  close(): void {
    if (this.decoder.state !== "closed") this.decoder.close();
    void this.context.close();
  }

  private play(data: AudioData): void {
    const buffer = this.context.createBuffer(data.numberOfChannels, data.numberOfFrames, RATE);
    for (let channel = 0; channel < data.numberOfChannels; ++channel) {
      data.copyTo(buffer.getChannelData(channel), { planeIndex: channel, format: "f32-planar" });
    }
    const nowMs = this.now();
    const ahead = data.timestamp / 1e6 - nowMs / 1e3; // seconds, mostly negative
    data.close();
    if (Number.isNaN(nowMs)) return;
    const begin = this.context.currentTime;
    let at = begin + ahead + Math.min(MOST_WAIT_S, this.pictureAge() + AHEAD_S + this.late);
    if (at < begin) {
      this.late = Math.min(MOST_WAIT_S, this.late + begin - at + 0.01);
      at = begin;
    } else {
      this.late *= 0.999;
    }
    if (Math.abs(at - this.next) < JUMP_S && this.next >= begin) at = this.next;
    const source = this.context.createBufferSource();
    source.buffer = buffer;
    source.connect(this.context.destination);
    source.start(at);
    this.next = at + buffer.duration;
  }
}
