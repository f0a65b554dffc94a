// The guest's voice: from the microphone, with echo and noise taken out by the browser, to Opus packets with the time of their capture.
const RATE = 48_000;
const FRAME = 960;
const FRAME_MS = 20;
const BITRATE = 24_000;
const LOOKAHEAD_MS = 6.5; // by which Opus delays: the first decoded sample is so much earlier than the first of its frame
const JUMP_MS = 100; // samples are missing: time goes on without them
const SLEW = 0.005; // the most by which time goes faster or slower than samples, for smaller errors
const HEAD_BYTES = 12;
const VOICE = 4; // vistel/audio/page_voice.py
const FLOOR = 1e-5;

/** What a person is told: why nothing is sent, or that it is. */
export type State = "off" | "asking" | "on" | "muted" | "refused" | "none" | "lost" | "cannot";
export const canSpeak = "AudioEncoder" in window && "AudioWorkletNode" in window;

export class Microphone {
  state: State = "off";
  level = 0; // root mean square of what is heard now
  sent = 0; // bytes
  private context: AudioContext | null = null;
  private track: MediaStreamTrack | null = null;
  private encoder: AudioEncoder | null = null;
  private readonly waiting = new Float32Array(FRAME);
  private filled = 0;
  private frame = 0; // number of the next; times are counted in samples, as the encoder wants them
  private anchor: number | null = null; // time of `performance` at which frame 0 would have begun [ms]
  private toPerformance = Infinity; // from the context's time [ms]

  /** timeAt: conference time [ms] at a time of `performance`; null: not known. */
  constructor(
    private readonly timeAt: (ms: number) => number | null,
    private readonly send: (data: ArrayBuffer) => void,
    private readonly changed: () => void,
  ) {}

  /** Begin, or unmute. To be called where somebody has clicked. */
  async open(): Promise<void> {
    if (!canSpeak || !navigator.mediaDevices) return this.become("cannot");
    if (this.track) return this.become("on");
    this.become("asking");
    try {
      const wanted = { echoCancellation: true, noiseSuppression: true, autoGainControl: true, channelCount: 1 };
      const stream = await navigator.mediaDevices.getUserMedia({ audio: wanted });
      const track = stream.getAudioTracks()[0]!;
      const context = new AudioContext({ sampleRate: RATE, latencyHint: "interactive" });
      await context.audioWorklet.addModule("microphone.js");
      const reader = new AudioWorkletNode(context, "microphone", { numberOfInputs: 1, numberOfOutputs: 0, channelCount: 1, channelCountMode: "explicit" });
      reader.port.onmessage = (event: MessageEvent<{ end: number; block: Float32Array }>) => this.take(event.data.end, event.data.block);
      context.createMediaStreamSource(stream).connect(reader);
      this.encoder = new AudioEncoder({ output: (chunk) => this.put(chunk), error: () => this.lose("cannot") });
      const opus = { application: "voip", frameDuration: FRAME_MS * 1000, usedtx: true, complexity: 5 };
      this.encoder.configure({ codec: "opus", sampleRate: RATE, numberOfChannels: 1, bitrate: BITRATE, opus } as AudioEncoderConfig);
      [this.context, this.track] = [context, track];
      track.onended = () => this.lose("lost");
      this.become("on");
    } catch (error) {
      const name = error instanceof DOMException ? error.name : "";
      this.lose(name === "NotAllowedError" ? "refused" : name === "NotFoundError" ? "none" : "cannot");
    }
  }

  /** Nothing is sent; the microphone stays open, so that unmuting takes no time. */
  mute(): void {
    if (this.state === "on") this.become("muted");
  }

  private become(state: State): void {
    this.state = state;
    if (this.track) this.track.enabled = state === "on";
    this.changed();
  }

  private lose(state: State): void {
    this.track?.stop();
    if (this.encoder?.state === "configured") this.encoder.close();
    void this.context?.close();
    this.context = this.track = this.encoder = this.anchor = null;
    [this.filled, this.level, this.toPerformance] = [0, 0, Infinity];
    this.become(state);
  }

  /** A block; end: the context's time of its end [s]. */
  private take(end: number, block: Float32Array): void {
    // A message is never early: the least of its delays counts, and rises slowly, for clocks that drift.
    this.toPerformance = Math.min(this.toPerformance + 0.001, performance.now() - end * 1000);
    const latency = Number((this.track?.getSettings() as { latency?: number } | undefined)?.latency ?? 0) * 1000;
    const begin = end * 1000 + this.toPerformance - latency - (block.length / RATE) * 1000;
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
    if (this.state !== "on" || this.level < FLOOR || this.encoder?.state !== "configured") return;
    const data = new AudioData({ format: "f32-planar", sampleRate: RATE, numberOfFrames: FRAME, numberOfChannels: 1, timestamp, data: this.waiting });
    this.encoder.encode(data);
    data.close();
  }

  private put(chunk: EncodedAudioChunk): void {
    const time = this.anchor === null ? null : this.timeAt(this.anchor + chunk.timestamp / 1000 - LOOKAHEAD_MS);
    if (time === null || this.state !== "on") return;
    const data = new ArrayBuffer(HEAD_BYTES + chunk.byteLength);
    const view = new DataView(data);
    [0x56, 0x50, VOICE, 0].forEach((byte, n) => view.setUint8(n, byte));
    view.setFloat64(4, time, true);
    chunk.copyTo(new Uint8Array(data, HEAD_BYTES));
    this.sent += data.byteLength;
    this.send(data);
  }
}
