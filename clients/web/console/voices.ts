// Voices of the room: heard from where the talkers' heads are, each sample when the picture of its capture is seen.
import { Quaternion, Vector3 } from "three";
import type { Room } from "./room";

export const VOICES = 2; // the first byte of a message of voices (vistel/audio/forwarded_voices.py)
const RATE = 48_000;
const HEAD_BYTES = 16;
const SOON_S = 0.004; // sound can be put out so soon, no sooner
const JUMP_S = 0.12; // a larger error of time is corrected at once
const STILL_S = 0.004; // a smaller one is left
const SLOWLY = 0.01; // the most by which speed is changed for it,
const QUICKLY = 0.06; // and where it is large
const LARGE_S = 0.025;
const FADE = 240; // samples, where a voice begins
const FOLLOW = 0.05; // of how the page's pictures come, with each frame
const LOST_MS = 300; // a larger change is followed at once
const HEARD_M = 0.5; // voices grow no louder than from here
const FORGIVEN = 0.99; // of a lateness, what is left of it with each packet
const KEPT_S = 20; // of silence, after which a talker is forgotten
const STORED = "vistel-volume";

export const canHear = "AudioDecoder" in window && "AudioContext" in window;

interface Talker {
  decoder: AudioDecoder;
  panner: PannerNode;
  next: number; // the context's time at which what has come so far ends [s]
  delayMs: number; // from capture to picture
  late: number; // what comes too late for its picture is played so much later [s]
  heardAt: number;
}

export class Voices {
  on = false;
  /** Of what is played: how far behind its picture [ms], newest last; for programs that measure. */
  readonly skews: number[] = [];
  private context: AudioContext | null = null;
  private gain: GainNode | null = null;
  private loud = Number(localStorage.getItem(STORED) ?? 1);
  private readonly talkers = new Map<string, Talker>();
  private shown: number | null = null; // from a frame's conference time to when it is seen, of `performance` [ms]

  /** ask: tell the gateway whether this page hears. */
  constructor(
    private readonly room: Room | null,
    private readonly ask: (hears: boolean) => void,
  ) {}

  /** Where what is heard can be tapped. */
  get output(): AudioNode | null {
    return this.gain;
  }

  /** Of what is played, 0 to 1. */
  get volume(): number {
    return this.loud;
  }
  set volume(volume: number) {
    this.loud = volume;
    localStorage.setItem(STORED, String(volume));
    if (this.gain) this.gain.gain.value = volume;
  }

  /** Hear, or not. Browsers allow sound where somebody has clicked. */
  turn(on: boolean): void {
    this.on = on && canHear;
    if (this.on && !this.context) {
      this.context = new AudioContext({ sampleRate: RATE, latencyHint: "interactive" });
      this.gain = new GainNode(this.context, { gain: this.loud });
      this.gain.connect(this.context.destination);
    }
    if (this.on) void this.context?.resume();
    else this.forget(() => true);
    this.again();
  }

  /** Tell the gateway once more: after a break of the connection. */
  again(): void {
    this.ask(this.on);
  }

  /** A frame has come; after: how long until it is seen [ms]. */
  frame(tMs: number, after: number): void {
    const shown = performance.now() + after - tMs;
    if (this.shown === null || Math.abs(shown - this.shown) > LOST_MS) this.shown = shown;
    else this.shown += FOLLOW * (shown - this.shown);
  }

  /** A message of voices. */
  take(data: ArrayBuffer): void {
    if (!this.on || !this.context || this.shown === null) return;
    const view = new DataView(data);
    for (let at = 1; at + HEAD_BYTES <= data.byteLength; ) {
      const size = view.getUint16(at, true);
      const name = new TextDecoder().decode(new Uint8Array(data, at + HEAD_BYTES, view.getUint8(at + 2)));
      const talker = this.talkers.get(name) ?? this.came(name);
      talker.delayMs = view.getFloat32(at + 12, true);
      talker.heardAt = this.context.currentTime;
      const packet = new Uint8Array(data, at + HEAD_BYTES + view.getUint8(at + 2), size - HEAD_BYTES - view.getUint8(at + 2));
      const timestamp = Math.round(view.getFloat64(at + 4, true) * 1000);
      if (talker.decoder.state === "configured") talker.decoder.decode(new EncodedAudioChunk({ type: "key", timestamp, data: packet }));
      at += size;
    }
  }

  /** Where heads and ears are now; to be called with each picture. */
  step(): void {
    if (!this.on || !this.context || !this.room) return;
    const { camera, figures } = this.room;
    const ear = camera.getWorldPosition(new Vector3());
    const turned = camera.getWorldQuaternion(new Quaternion());
    const [ahead, up] = [new Vector3(0, 0, -1).applyQuaternion(turned), new Vector3(0, 1, 0).applyQuaternion(turned)];
    const { listener } = this.context;
    if ("positionX" in listener) {
      [listener.positionX.value, listener.positionY.value, listener.positionZ.value] = ear.toArray();
      [listener.forwardX.value, listener.forwardY.value, listener.forwardZ.value] = ahead.toArray();
      [listener.upX.value, listener.upY.value, listener.upZ.value] = up.toArray();
    }
    for (const [name, { panner }] of this.talkers) {
      const figure = figures.get(name);
      if (!figure?.root.visible) continue;
      const mouth = figure.joint("head").getWorldPosition(new Vector3());
      [panner.positionX.value, panner.positionY.value, panner.positionZ.value] = mouth.toArray();
    }
    const now = this.context.currentTime;
    this.forget((talker) => now - talker.heardAt > KEPT_S);
  }

  private came(name: string): Talker {
    const context = this.context!;
    const panner = new PannerNode(context, { panningModel: "HRTF", distanceModel: "inverse", refDistance: HEARD_M, rolloffFactor: 0.5 });
    panner.connect(this.gain!);
    const talker: Talker = { decoder: null!, panner, next: 0, delayMs: 0, late: 0, heardAt: context.currentTime };
    const decoder = new AudioDecoder({ output: (data) => this.play(talker, data), error: () => this.forget((t) => t === talker) });
    decoder.configure({ codec: "opus", sampleRate: RATE, numberOfChannels: 1 });
    talker.decoder = decoder;
    this.talkers.set(name, talker);
    return talker;
  }

  private forget(which: (talker: Talker) => boolean): void {
    for (const [name, talker] of this.talkers) {
      if (!which(talker)) continue;
      if (talker.decoder.state !== "closed") talker.decoder.close();
      talker.panner.disconnect();
      this.talkers.delete(name);
    }
  }

  /** The context's time of what is heard at a time of `performance` [ms]. */
  private contextAt(ms: number): number {
    const context = this.context!;
    const { contextTime, performanceTime } = context.getOutputTimestamp();
    if (contextTime && performanceTime) return contextTime + (ms - performanceTime) / 1000;
    return context.currentTime - (context.outputLatency || context.baseLatency) + (ms - performance.now()) / 1000;
  }

  private play(talker: Talker, data: AudioData): void {
    const context = this.context!;
    const samples = new Float32Array(data.numberOfFrames);
    data.copyTo(samples, { planeIndex: 0, format: "f32-planar" });
    const capturedMs = data.timestamp / 1000;
    data.close();
    if (!samples.length || this.shown === null) return;
    const wanted = this.contextAt(capturedMs + talker.delayMs + this.shown);
    const soonest = context.currentTime + SOON_S;
    talker.late = Math.max(talker.late * FORGIVEN, soonest - wanted);
    if (talker.late > 2) return void (talker.late = 0); // of long ago
    let at = wanted + Math.max(0, talker.late);
    const error = at - talker.next;
    let rate = 1;
    if (talker.next >= soonest - SOON_S && Math.abs(error) < JUMP_S) {
      at = Math.max(talker.next, context.currentTime);
      const most = Math.abs(error) > LARGE_S ? QUICKLY : SLOWLY;
      if (Math.abs(error) > STILL_S) rate = 1 - Math.max(-most, Math.min(most, error));
    } else for (let n = 0; n < Math.min(FADE, samples.length); n++) samples[n]! *= n / FADE;
    const buffer = context.createBuffer(1, samples.length, RATE);
    buffer.copyToChannel(samples, 0);
    const source = new AudioBufferSourceNode(context, { buffer, playbackRate: rate });
    source.connect(talker.panner);
    source.start(at);
    talker.next = at + samples.length / RATE / rate;
    this.skews.push((at - wanted) * 1000);
    if (this.skews.length > 500) this.skews.shift();
  }
}
