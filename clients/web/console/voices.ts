// Voices of the room: heard from where the talkers' heads are, each sample when the picture of its capture is seen.
import { Quaternion, Vector3 } from "three";
import type { Room } from "./room";

export const VOICES = 2; // the first byte of a message of voices (vistel/audio/forwarded_voices.py)
const RATE = 48_000;
const HEAD_BYTES = 16;
const SOON_S = 0.004; // sound can be put out so soon, no sooner
const STILL_S = 0.004; // a smaller error of time is left
const SLOWLY = 0.01; // the most by which speed is changed for one,
const QUICKLY = 0.06; // and where it is large
const LARGE_S = 0.025;
const JUMP_S = 0.06; // so far behind, packets are left out until it is made up; so far ahead, there is a pause
const QUIET = 0.004; // such packets are left out sooner
const FADE = 240; // samples, where a voice begins
const SHOWN = 31; // frames that tell when pictures are seen
const ARRIVED = 250; // packets that tell how late they come: five seconds of a voice,
const IN_TIME = 0.95; // of which so many are to be heard; a stall of the page is not waited for
const CLOCKED = 31; // packets that tell how the context's time goes
const OLD_S = 2; // what comes later is of no use
const HEARD_M = 0.5; // voices grow no louder than from here
const KEPT_S = 20; // of silence, after which a talker is forgotten
const STORED = "vistel-volume";

export const canHear = "AudioDecoder" in window && "AudioContext" in window;

interface Talker {
  decoder: AudioDecoder;
  panner: PannerNode;
  next: number; // the context's time at which what has come so far ends [s]
  delayMs: number; // from capture to picture
  readonly late: Newest; // by which the last packets came too late to be heard with their pictures; below zero: in time [s]
  heardAt: number;
}

/** The newest values of something. */
class Newest {
  private readonly values: number[] = [];

  constructor(private readonly most: number) {}

  add(value: number): void {
    this.values.push(value);
    if (this.values.length > this.most) this.values.shift();
  }

  /** The value that a share of them does not exceed; null: there is none. */
  below(share: number): number | null {
    return [...this.values].sort((a, b) => a - b)[Math.floor(share * (this.values.length - 1))] ?? null;
  }

  clear(): void {
    this.values.length = 0;
  }
}

export class Voices {
  on = false;
  /** Of what is played: how far behind its picture [ms], newest last; for programs that measure. */
  readonly skews: number[] = [];
  private context: AudioContext | null = null;
  private gain: GainNode | null = null;
  private loud = Number(localStorage.getItem(STORED) ?? 1);
  private readonly talkers = new Map<string, Talker>();
  private readonly shown = new Newest(SHOWN); // from a frame's conference time to when it is seen, of `performance` [ms]
  private readonly clocked = new Newest(CLOCKED); // from `performance` to the context's time of what is heard then [ms]

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
      this.context.onstatechange = () => this.clocked.clear(); // while it is suspended, its time stands still
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
    this.shown.add(performance.now() + after - tMs);
  }

  /** A message of voices. */
  take(data: ArrayBuffer): void {
    if (!this.on || this.context?.state !== "running") return;
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
    const talker: Talker = { decoder: null!, panner, next: 0, delayMs: 0, late: new Newest(ARRIVED), heardAt: context.currentTime };
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
    if (contextTime && performanceTime) this.clocked.add(contextTime * 1000 - performanceTime);
    else this.clocked.add((context.currentTime - (context.outputLatency || context.baseLatency)) * 1000 - performance.now());
    return (ms + this.clocked.below(0.5)!) / 1000;
  }

  private play(talker: Talker, data: AudioData): void {
    const context = this.context!;
    const samples = new Float32Array(data.numberOfFrames);
    data.copyTo(samples, { planeIndex: 0, format: "f32-planar" });
    const capturedMs = data.timestamp / 1000;
    data.close();
    const shown = this.shown.below(0.5);
    if (!samples.length || shown === null) return;
    const wanted = this.contextAt(capturedMs + talker.delayMs + shown);
    const soonest = context.currentTime + SOON_S;
    if (soonest - wanted > OLD_S) return;
    talker.late.add(soonest - wanted);
    let at = wanted + Math.max(0, talker.late.below(IN_TIME)!);
    if (at < soonest - STILL_S) return; // the newest sound is worth more than all of it
    let rate = 1;
    if (talker.next >= context.currentTime) {
      const error = at - talker.next;
      if (error < -JUMP_S || (error < -STILL_S && loudness(samples) < QUIET)) return;
      if (error < JUMP_S) {
        at = talker.next;
        const most = Math.abs(error) > LARGE_S ? QUICKLY : SLOWLY;
        if (Math.abs(error) > STILL_S) rate = 1 - Math.max(-most, Math.min(most, error));
      }
    }
    if (at !== talker.next) for (let n = 0; n < Math.min(FADE, samples.length); n++) samples[n]! *= n / FADE;
    const buffer = context.createBuffer(1, samples.length, RATE);
    buffer.copyToChannel(samples, 0);
    const source = new AudioBufferSourceNode(context, { buffer, playbackRate: rate });
    source.connect(talker.panner);
    source.start(Math.max(at, context.currentTime));
    talker.next = Math.max(at, context.currentTime) + samples.length / RATE / rate;
    this.skews.push((at - wanted) * 1000);
    if (this.skews.length > 500) this.skews.shift();
  }
}

function loudness(samples: Float32Array): number {
  return Math.sqrt(samples.reduce((sum, x) => sum + x * x, 0) / samples.length);
}
