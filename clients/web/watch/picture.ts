// Pictures from the stream onto a canvas: H.264 by WebCodecs; JPEG where a browser has none (a page that is not from
// localhost or by https may not use them).
import { KEY_PICTURE, type Packet } from "./messages";

const MOST_WAITING = 4; // in the decoder; more are late

export const canDecode = "VideoDecoder" in window;

export class Picture {
  private readonly ink: CanvasRenderingContext2D;
  private decoder: VideoDecoder | null = null;
  private lost = true;

  /** shown: is told of each picture that is on the page, with the conference time at which it was drawn [us]; wantKey: asks for
   * one that stands for itself. */
  constructor(
    private readonly canvas: HTMLCanvasElement,
    private readonly shown: (tUs: number) => void,
    private readonly wantKey: () => void,
  ) {
    const ink = canvas.getContext("2d", { alpha: false });
    if (!ink) throw new Error("no 2D canvas");
    this.ink = ink;
  }

  show(packet: Packet): void {
    if (!canDecode) {
      void this.showJpeg(packet);
      return;
    }
    const key = packet.kind === KEY_PICTURE;
    if (key && (this.lost || this.decoder?.state !== "configured")) this.begin(packet.data);
    if (this.lost || !this.decoder) return;
    if (this.decoder.decodeQueueSize > MOST_WAITING && !key) {
      this.lose(); // go on with a key picture rather than later and later
      return;
    }
    this.decoder.decode(new EncodedVideoChunk({ type: key ? "key" : "delta", timestamp: packet.tUs, data: packet.data }));
  }

  /** Nothing more comes of what was. */
  reset(): void {
    this.lost = true;
  }

  private lose(): void {
    this.lost = true;
    this.wantKey();
  }

  private begin(key: Uint8Array): void {
    const codec = codecOf(key);
    if (codec === null) return;
    if (this.decoder && this.decoder.state !== "closed") this.decoder.close();
    const decoder = new VideoDecoder({
      output: (frame) => {
        this.draw(frame, frame.displayWidth, frame.displayHeight, frame.timestamp);
        frame.close();
      },
      error: () => {
        if (this.decoder === decoder) this.lose();
      },
    });
    decoder.configure({ codec, optimizeForLatency: true });
    this.decoder = decoder;
    this.lost = false;
  }

  private async showJpeg(packet: Packet): Promise<void> {
    const bitmap = await createImageBitmap(new Blob([packet.data as Uint8Array<ArrayBuffer>], { type: "image/jpeg" }));
    this.draw(bitmap, bitmap.width, bitmap.height, packet.tUs);
    bitmap.close();
  }

  private draw(image: CanvasImageSource, width: number, height: number, tUs: number): void {
    if (this.canvas.width !== width || this.canvas.height !== height) {
      this.canvas.width = width;
      this.canvas.height = height;
    }
    this.ink.drawImage(image, 0, 0);
    this.shown(tUs);
  }
}

/** What WebCodecs calls the H.264 of a key picture: profile and level stand in its sequence parameter set. */
export function codecOf(annexB: Uint8Array): string | null {
  for (let i = 0; i + 6 < annexB.length; ++i) {
    if (annexB[i] === 0 && annexB[i + 1] === 0 && annexB[i + 2] === 1 && ((annexB[i + 3] ?? 0) & 31) === 7) {
      return "avc1." + Array.from(annexB.subarray(i + 4, i + 7), (b) => b.toString(16).padStart(2, "0")).join("");
    }
  }
  return null;
}
