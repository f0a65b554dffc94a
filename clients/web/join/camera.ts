// The guest's camera: its pictures go to a worker of this page, which finds landmarks in them, and no farther. What is sent are these.
import type { Link } from "../connection/link";
import type { Answer, Picture } from "./camera_worker";
import { type Found, Judge, type Note, record } from "./landmarks";

/** What a person is told: why nothing is seen, or that they are. */
export type State = "off" | "asking" | "loading" | "on" | "refused" | "none" | "lost" | "cannot";
const CALIBRATION_S = 10;
const CALIBRATION_PICTURES = 6; // and so many at least, where each takes seconds
const WORKER = "landmarks/camera_worker.js";
const WANTED = { width: { ideal: 640 }, height: { ideal: 480 }, frameRate: { ideal: 30 }, facingMode: "user" };
const SIZE = 480; // of a picture in which is looked, upright; a larger one tells no more
const OTHER_MS = 2000; // somebody else in the picture is spoken of for so long
const EMPTY_MS = 100; // how often it is said that nothing is seen

export class Camera {
  state: State = "off";
  note: Note = "";
  sent = 0; // bytes
  tookMs = 0; // for the last picture
  seen: Found = {};
  readonly video = document.createElement("video");
  private worker: Worker | null = null;
  private track: MediaStreamTrack | null = null;
  private judge = new Judge();
  private busy = false;
  private calibratedAt = -Infinity;
  private pictures = Infinity; // since calibration began
  private otherAt = -Infinity;
  private emptyAt = -Infinity;

  /** enters: whether what is seen may be sent now. */
  constructor(
    private readonly link: () => Link,
    private readonly enters: () => boolean,
    private readonly changed: () => void,
  ) {
    this.video.muted = true;
    this.video.playsInline = true;
  }

  /** Seconds of the calibration that are left; 0 when there is none. */
  get calibrates(): number {
    const few = this.pictures < CALIBRATION_PICTURES ? 1 : 0;
    return Math.max(few, CALIBRATION_S - (performance.now() - this.calibratedAt) / 1000);
  }

  /** Begin. To be called where somebody has clicked. */
  async open(): Promise<void> {
    if (!navigator.mediaDevices || !("OffscreenCanvas" in window)) return this.become("cannot");
    this.become("asking");
    try {
      const stream = await navigator.mediaDevices.getUserMedia({ video: WANTED });
      this.track = stream.getVideoTracks()[0]!;
      this.track.onended = () => this.close("lost");
      this.video.srcObject = stream;
      await this.video.play();
    } catch (error) {
      const name = error instanceof DOMException ? error.name : "";
      return this.close(name === "NotAllowedError" ? "refused" : name === "NotFoundError" ? "none" : "cannot");
    }
    this.become("loading");
    this.worker = new Worker(WORKER);
    this.worker.onmessage = ({ data }: MessageEvent<Answer>) => this.hear(data);
    this.worker.onerror = () => this.close("cannot"); // its files are not there
  }

  /** Sit, look at the camera, raise both hands. */
  calibrate(): void {
    [this.calibratedAt, this.pictures] = [performance.now(), 0];
    this.changed();
  }

  close(state: State = "off"): void {
    this.track?.stop();
    this.worker?.terminate();
    this.track = this.worker = this.video.srcObject = null;
    [this.busy, this.seen, this.note, this.tookMs] = [false, {}, "", 0];
    [this.calibratedAt, this.pictures] = [-Infinity, Infinity];
    this.judge = new Judge();
    this.say({});
    this.become(state);
  }

  private hear(answer: Answer): void {
    if (answer.failed !== undefined) return this.close("cannot");
    if (answer.ready) {
      this.become("on");
      return void this.look();
    }
    if (this.tookMs === 0) this.calibrate(); // the first picture takes longer than all others
    this.pictures++;
    this.busy = false;
    this.tookMs = answer.tookMs ?? 0;
    const found = answer.found ?? {};
    const at = answer.at ?? 0;
    const aspect = this.video.videoWidth / Math.max(1, this.video.videoHeight);
    const note = this.judge.note(found, aspect, answer.light ?? 0, at);
    if (note === "other") this.otherAt = performance.now();
    const told = note === "" && performance.now() - this.otherAt < OTHER_MS ? "other" : note;
    this.seen = found;
    // Of a picture in which somebody else is, or nobody, nothing is believed.
    if (told === "dark" || told === "nobody" || told === "other") this.say({});
    else this.say(found, at, aspect);
    if (told !== this.note) {
      this.note = told;
      this.changed();
    }
    this.look();
  }

  /** Look at the next picture, when there is one. */
  private look(): void {
    if (this.state !== "on") return;
    if (document.hidden) {
      this.note = "hidden";
      return void setTimeout(() => this.look(), EMPTY_MS);
    }
    this.video.requestVideoFrameCallback(() => void this.give());
  }

  private async give(): Promise<void> {
    if (this.busy || !this.worker || document.hidden) return this.look();
    this.busy = true;
    const at = performance.timeOrigin + performance.now();
    const height = Math.min(SIZE, this.video.videoHeight);
    const resizeWidth = Math.round((height * this.video.videoWidth) / this.video.videoHeight);
    try {
      const bitmap = await createImageBitmap(this.video, { resizeWidth, resizeHeight: height });
      this.worker?.postMessage({ bitmap, at } satisfies Picture, [bitmap]);
    } catch {
      this.busy = false; // no picture just now
      this.look();
    }
  }

  /** Send what is seen; that nothing is, seldom. */
  private say(found: Found, at = performance.timeOrigin + performance.now(), aspect = 1): void {
    if (!this.enters()) return;
    if (!found.body) {
      if (performance.now() - this.emptyAt < EMPTY_MS) return;
      this.emptyAt = performance.now();
    }
    const data = record(found, aspect, this.calibrates > 0);
    this.sent += data.byteLength;
    this.link().tell({ kind: "seen", data, at }, [data]);
  }

  private become(state: State): void {
    this.state = state;
    this.changed();
  }
}
