// Reads a microphone on the browser's thread for sound: blocks of 10 ms, mono, go to the port that is given.
import type { Block } from "../connection/messages";

declare const currentTime: number;
declare const sampleRate: number;
declare const registerProcessor: (name: string, processor: new () => AudioWorkletProcessor) => void;
declare class AudioWorkletProcessor {
  readonly port: MessagePort;
}

class Reader extends AudioWorkletProcessor {
  private to: MessagePort | null = null;
  private block = new Float32Array(sampleRate / 100);
  private filled = 0;

  constructor() {
    super();
    this.port.onmessage = ({ data }: MessageEvent<MessagePort>) => (this.to = data);
  }

  process(inputs: Float32Array[][]): boolean {
    const samples = inputs[0]?.[0];
    if (!samples) return true;
    for (let at = 0; at < samples.length; ) {
      const take = Math.min(samples.length - at, this.block.length - this.filled);
      this.block.set(samples.subarray(at, at + take), this.filled);
      at += take;
      this.filled += take;
      if (this.filled < this.block.length) continue;
      this.to?.postMessage({ end: currentTime + at / sampleRate, block: this.block } satisfies Block, [this.block.buffer]);
      this.block = new Float32Array(sampleRate / 100);
      this.filled = 0;
    }
    return true;
  }
}
registerProcessor("microphone", Reader);
