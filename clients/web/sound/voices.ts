// Voices of the room: heard from where the talkers' heads are, each sample when the picture of its capture is seen. This thread only
// says when that is and where they are; what is said goes past it, from a worker to the browser's thread for sound.
import { Quaternion, Vector3 } from "three";
import type { Room } from "../console/room";
import type { Link } from "../connection/link";
import type { Played, Told } from "./player_worklet";

const RATE = 48_000;
const SEEN = 15; // pictures that tell when pictures are seen, and how the sound's clock goes
const TELL_MS = 100; // how often a talker's player is told when pictures are seen, also where none are drawn
const HEARD_M = 0.5; // voices grow no louder than from here
const STORED = "vistel-volume";

export const canHear = "AudioDecoder" in window && "AudioWorkletNode" in window;

interface Talker {
  node: AudioWorkletNode;
  panner: PannerNode;
}

/** The middle of the newest values of something. */
class Middle {
  private values: number[] = [];

  add(value: number): void {
    this.values = [...this.values, value].slice(-SEEN);
  }

  get value(): number | null {
    return [...this.values].sort((a, b) => a - b)[this.values.length >> 1] ?? null;
  }

  clear(): void {
    this.values = [];
  }
}

export class Voices {
  on = false;
  /** Of what is played, by talker; for programs that measure. */
  readonly played = new Map<string, Played>();
  private context: AudioContext | null = null;
  private gain: GainNode | null = null;
  private loud = Number(localStorage.getItem(STORED) ?? 1);
  private readonly talkers = new Map<string, Talker>();
  private sounding = true; // time goes on as it should, see `leap`
  private readonly pictures = new Middle(); // from a picture's conference time to when it is seen, of `performance` [ms]
  private readonly clock = new Middle(); // from `performance` to the context's time of what is heard then [ms]

  /** ask: tell the gateway whether this page hears. */
  constructor(
    private readonly room: Room | null,
    private readonly link: () => Link,
    private readonly ask: (hears: boolean) => void,
  ) {
    setInterval(() => this.tell(), TELL_MS);
    if (room) room.seen = (tMs, atMs) => this.pictures.add(atMs - tMs);
  }

  /** Where what is heard can be tapped. */
  get output(): AudioNode | null {
    return this.gain;
  }

  /** From conference time to when its picture is seen [ms], of `performance`, without a talker's own delay. */
  get pictureMs(): number | null {
    return this.pictures.value;
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
  async turn(on: boolean): Promise<void> {
    this.on = on && canHear;
    if (this.on && !this.context) {
      const context = (this.context = new AudioContext({ sampleRate: RATE, latencyHint: "interactive" }));
      await context.audioWorklet.addModule("player.js");
      this.gain = new GainNode(context, { gain: this.loud });
      this.gain.connect(context.destination);
      context.onstatechange = () => this.again();
    }
    if (this.on) void this.context?.resume();
    this.again();
  }

  /** Tell once more what is heard: after a break of the connection, or of the sound. */
  again(): void {
    const hears = this.on && this.sounding && this.gain !== null && this.context!.state === "running";
    if (!hears) this.clock.clear(); // its time stands still, or will
    this.link().tell({ kind: "hear", hears });
    this.ask(hears);
  }

  /** In a log: time has leapt, stands still or goes on. What was said before is heard no more. sounding: it goes on at its own speed. */
  leap(sounding: boolean): void {
    this.sounding = sounding;
    this.pictures.clear();
    this.link().tell({ kind: "hear", hears: false });
    this.again();
  }

  /** Somebody's voice comes out of a port. */
  talker(name: string, port: MessagePort): void {
    if (!this.gain) return;
    this.silent(name);
    const context = this.context!;
    const panner = new PannerNode(context, { panningModel: "HRTF", distanceModel: "inverse", refDistance: HEARD_M, rolloffFactor: 0.5 });
    const node = new AudioWorkletNode(context, "voice", { numberOfInputs: 0, numberOfOutputs: 1, outputChannelCount: [1] });
    node.connect(panner).connect(this.gain);
    node.port.onmessage = ({ data }: MessageEvent<Played>) => this.played.set(name, data);
    this.talkers.set(name, { node, panner });
    this.tell();
    this.place();
    node.port.postMessage({ port } satisfies Told, [port]);
  }

  /** No voice of that name comes any more. */
  silent(name: string): void {
    const talker = this.talkers.get(name);
    talker?.node.port.postMessage({ over: true } satisfies Told);
    talker?.node.disconnect();
    talker?.panner.disconnect();
    this.talkers.delete(name);
  }

  /** Where heads and ears are now; to be called with each picture. */
  step(): void {
    if (this.on && this.context && this.talkers.size) this.place();
  }

  private tell(): void {
    if (!this.on || !this.context || !this.talkers.size) return;
    const told: Told = { clockMs: this.clockMs(this.context), pictureMs: this.pictures.value };
    for (const { node } of this.talkers.values()) node.port.postMessage(told);
  }

  private place(): void {
    if (!this.room) return;
    const { camera, figures } = this.room;
    const ear = camera.getWorldPosition(new Vector3());
    const turned = camera.getWorldQuaternion(new Quaternion());
    const [ahead, up] = [new Vector3(0, 0, -1).applyQuaternion(turned), new Vector3(0, 1, 0).applyQuaternion(turned)];
    const { listener } = this.context!;
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
  }

  private clockMs(context: AudioContext): number {
    const { contextTime, performanceTime } = context.getOutputTimestamp();
    if (contextTime && performanceTime) this.clock.add(contextTime * 1000 - performanceTime);
    else this.clock.add((context.currentTime - (context.outputLatency || context.baseLatency)) * 1000 - performance.now());
    return this.clock.value!;
  }
}
