// The guest's microphone, with echo and noise taken out by the browser. What it hears goes past this thread (connection/speaking.ts).
import type { Link } from "../connection/link";

const RATE = 48_000;

/** What a person is told: why nothing is sent, or that it is. */
export type State = "off" | "asking" | "on" | "muted" | "refused" | "none" | "lost" | "cannot";
export const canSpeak = "AudioEncoder" in window && "AudioWorkletNode" in window;

export class Microphone {
  state: State = "off";
  level = 0; // root mean square of what is heard now
  sent = 0; // bytes
  private context: AudioContext | null = null;
  private track: MediaStreamTrack | null = null;

  /** speaks: whether what is heard may be sent now. */
  constructor(
    private readonly link: () => Link,
    private readonly speaks: () => boolean,
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
      this.track = stream.getAudioTracks()[0]!;
      this.context = new AudioContext({ sampleRate: RATE, latencyHint: "interactive" });
      await this.context.audioWorklet.addModule("microphone.js");
      const reader = new AudioWorkletNode(this.context, "microphone", { numberOfInputs: 1, numberOfOutputs: 0, channelCount: 1, channelCountMode: "explicit" });
      const { port1, port2 } = new MessageChannel();
      reader.port.postMessage(port1, [port1]);
      const latencyMs = Number((this.track.getSettings() as { latency?: number }).latency ?? 0) * 1000;
      this.link().tell({ kind: "microphone", port: port2, latencyMs }, [port2]);
      this.context.createMediaStreamSource(stream).connect(reader);
      this.track.onended = () => this.lose("lost");
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

  /** Sending begins or ends: somebody has entered. */
  tell(): void {
    this.link().tell({ kind: "speak", speaks: this.state === "on" && this.speaks() });
  }

  lose(state: State): void {
    this.track?.stop();
    void this.context?.close();
    this.context = this.track = null;
    this.level = 0;
    this.become(state);
  }

  private become(state: State): void {
    this.state = state;
    if (this.track) this.track.enabled = state === "on";
    this.tell();
    this.changed();
  }
}
