// What a guest shows live: their screen, a window, a tab, or what their camera sees, on a panel that everybody sees.
import type { Table } from "../console/wire";
import type { FromEncoder, ToEncoder } from "./screen_worker";
import { text } from "./words";

type Source = "screen" | "camera";
type Said = { show: string; live: true } | { live: false };
/** As Chromium has it; other browsers have none on the page. */
declare class MediaStreamTrackProcessor {
  constructor(init: { track: MediaStreamTrack; maxBufferSize?: number });
  readonly readable: ReadableStream<VideoFrame>;
}

const CARD = 640; // pixels of the longer side of what the panel shows before and after
const MOST = { width: { max: 1600 }, height: { max: 1600 }, frameRate: { max: 10 } }; // what is captured: no more is sent
const WAIT_MS = 15_000; // for the panel
const can = typeof MediaStreamTrackProcessor === "function" && typeof VideoEncoder === "function";

export class Sharing {
  /** What is shown; null: nothing. */
  source: Source | null = null;
  /** What goes on, or why nothing can be shown; empty: nothing. */
  told = "";
  /** Of the stream so far, and what it is encoded with. */
  readonly sent = { pictures: 0, bytes: 0, codec: "" };
  private stream: MediaStream | null = null;
  private worker: Worker | null = null;
  private size: [number, number] | null = null; // of what is sent, once it is known: a panel may be put up
  private asked = false; // for the panel
  private stands = false; // the panel is there
  private table: Table | null = null;
  private waits: ReturnType<typeof setTimeout> | undefined;

  /** about: the guest's participant and name. */
  constructor(
    private readonly token: string,
    private readonly about: () => { participant: string; name: string } | null,
    private readonly say: (said: Said) => void,
    private readonly changed: () => void,
  ) {}

  async begin(source: Source): Promise<void> {
    if (this.source) return;
    this.source = source;
    this.tell(text("share_asks"));
    try {
      const devices = navigator.mediaDevices;
      this.stream = await (source === "screen" ? devices.getDisplayMedia({ video: MOST, audio: false }) : devices.getUserMedia({ video: MOST }));
    } catch {
      return this.end(text("share_refused"));
    }
    this.stream.getVideoTracks()[0]!.onended = () => this.end(); // the browser's own button, a window that is closed, a camera that goes
    this.encode();
  }

  /** Show nothing any more. reason: why, in a line. */
  end(reason = ""): void {
    clearTimeout(this.waits);
    this.worker?.terminate();
    for (const track of this.stream?.getTracks() ?? []) track.stop();
    if (this.source && this.worker) this.say({ live: false });
    [this.source, this.stream, this.worker, this.size, this.asked, this.stands] = [null, null, null, null, false, false];
    this.tell(reason);
  }

  /** The connection was away, and is back: the panel goes with the visit before, and another one is put up once it has gone. */
  again(): void {
    if (!this.stream) return;
    this.worker?.terminate();
    this.tell(text("share_again"));
    this.encode();
  }

  /** The world has answered. */
  hear(words: { done: boolean; reason: string }): void {
    if (!words.done) this.end(words.reason);
  }

  /** What is in the room now. */
  see(table: Table): void {
    this.table = table;
    const who = this.about()?.participant;
    const stands = table.things.some((thing) => thing.screen !== null && thing.screen === who);
    if (this.size && !this.asked && !stands && table.people.some((p) => p.name === who)) {
      this.asked = true;
      void this.putUp(...this.size);
    } else if (stands && this.asked && !this.stands && this.worker) {
      clearTimeout(this.waits);
      const address = `${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/guest/screen`;
      this.worker.postMessage({ kind: "go", address, token: this.token } satisfies ToEncoder);
      this.tell(text("share_on"));
    } else if (!stands && this.stands && this.worker) {
      this.end(text("share_away"));
    }
    this.stands = stands && this.asked && this.worker !== null;
  }

  private encode(): void {
    const frames = new MediaStreamTrackProcessor({ track: this.stream!.getVideoTracks()[0]!, maxBufferSize: 2 }).readable;
    const worker = new Worker("screen.js", { type: "module" });
    [this.worker, this.size, this.asked, this.stands] = [worker, null, false, false];
    clearTimeout(this.waits);
    worker.onmessage = ({ data }: MessageEvent<FromEncoder>) => {
      if (this.worker === worker) this.take(data);
    };
    worker.postMessage({ kind: "begin", frames, text: this.source === "screen" } satisfies ToEncoder, [frames]);
    this.waits = setTimeout(() => this.end(text("share_cannot")), WAIT_MS);
  }

  private take(said: FromEncoder): void {
    if (said.kind === "ready") {
      this.sent.codec = said.codec;
      this.size = [said.width, said.height];
      if (this.table) this.see(this.table);
    } else if (said.kind === "sent") {
      Object.assign(this.sent, { pictures: said.pictures, bytes: said.bytes });
    } else if (said.reason) {
      this.end(said.reason === "codec" ? text("share_cannot") : said.reason);
    }
  }

  /** Have a panel put up, with a plain picture that says whose it is. */
  private async putUp(width: number, height: number): Promise<void> {
    const { worker } = this;
    const title = text(this.source === "camera" ? "share_camera_of" : "share_screen_of", this.about()?.name ?? "");
    try {
      const answer = await fetch("guest/page", {
        method: "POST",
        body: await card(title, width, height),
        headers: { Authorization: `Bearer ${this.token}` },
      });
      if (!answer.ok) throw new Error(await answer.text());
      if (this.worker !== worker) return; // it has ended, or begins again
      this.say({ show: title, live: true });
    } catch (fault) {
      if (this.worker === worker) this.end(`${text("show_cannot")} ${fault instanceof Error ? fault.message : ""}`);
    }
  }

  private tell(what: string): void {
    this.told = what;
    this.changed();
  }
}

/** Nothing of what is shown is kept with the room: this picture is. */
async function card(title: string, width: number, height: number): Promise<Blob> {
  const drawn = document.createElement("canvas");
  const scale = CARD / Math.max(width, height);
  [drawn.width, drawn.height] = [Math.round(width * scale), Math.round(height * scale)];
  const pen = drawn.getContext("2d")!;
  pen.fillStyle = "#30363c";
  pen.fillRect(0, 0, drawn.width, drawn.height);
  [pen.fillStyle, pen.textAlign, pen.textBaseline] = ["#e8eaec", "center", "middle"];
  pen.font = `${Math.round(CARD / 16)}px sans-serif`;
  pen.fillText(title, drawn.width / 2, drawn.height / 2, drawn.width * 0.9);
  return new Promise((done, failed) => drawn.toBlob((made) => (made ? done(made) : failed(new Error("no picture"))), "image/png"));
}

/** Choose what is shown; nothing while something is. */
export function ShareChoices({ sharing }: { sharing: Sharing }) {
  if (sharing.source !== null) return null;
  return (
    <>
      <button type="button" id="share-screen" disabled={!can} onClick={() => void sharing.begin("screen")}>{text(can ? "share_screen" : "share_none")}</button>
      {can && <button type="button" id="share-camera" onClick={() => void sharing.begin("camera")}>{text("share_camera")}</button>}
    </>
  );
}

/** What goes on, and its end. */
export function ShareButtons({ sharing }: { sharing: Sharing }) {
  return (
    <>
      {sharing.source !== null && <button type="button" id="share-end" aria-pressed="true" onClick={() => sharing.end()}>{text("share_end")}</button>}
      {sharing.told && <span role="status" id="share-told">{sharing.told}</span>}
    </>
  );
}
