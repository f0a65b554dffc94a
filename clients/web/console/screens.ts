// What participants show live: decoded, and drawn on the panels that follow them. The bytes: vistel/session/screens.py.
import { type Group, LinearMipmapLinearFilter, Mesh, MeshBasicMaterial, SRGBColorSpace, Texture } from "three";
import { SCREENS } from "../connection/kinds";
import type { ThingRow } from "./wire";

const HEAD_BYTES = 24;
const SIDE = 1600; // pixels, as vistel/protocol/pages/screen_parts.py has it
const PIXELS = 1600 * 1200; // the same
const SILENT_MS = 6000; // of the room's time: without a picture for so long, nothing is shown any more
const LOOK_MS = 1500; // how often that is looked after
const MOST_WAITING = 30; // for the decoder
const MOST_FAULTS = 10; // of a stream, without a picture between

export interface ScreenPicture {
  participant: string;
  key: boolean;
  codec: string;
  stream: bigint;
  tUs: number;
  data: Uint8Array<ArrayBuffer>;
}

/** A message; null where it is none. */
export function pictureOf(message: ArrayBuffer): ScreenPicture | null {
  if (message.byteLength <= HEAD_BYTES) return null;
  const view = new DataView(message);
  const [named, codecs] = [view.getUint8(2), view.getUint8(3)];
  if (view.getUint8(0) !== SCREENS || message.byteLength <= HEAD_BYTES + named + codecs) return null;
  const text = (at: number, size: number) => new TextDecoder().decode(new Uint8Array(message, at, size));
  return {
    participant: text(HEAD_BYTES, named),
    key: view.getUint8(1) === 1,
    codec: text(HEAD_BYTES + named, codecs),
    stream: view.getBigUint64(8, true),
    tUs: Number(view.getBigUint64(16, true)),
    data: new Uint8Array(message, HEAD_BYTES + named + codecs),
  };
}

/** What one participant shows. */
class Screen {
  readonly texture = new Texture();
  shows = false; // there is a picture
  drawn = 0; // pictures that were decoded
  private decoder: VideoDecoder | null = null;
  private stream = -1n;
  private faults = 0;
  private silentMs = 0; // since the last picture

  constructor(private readonly changed: () => void) {
    this.texture.colorSpace = SRGBColorSpace;
    this.texture.flipY = false;
    this.texture.minFilter = LinearMipmapLinearFilter;
  }

  take(picture: ScreenPicture): void {
    if (picture.stream !== this.stream) {
      this.stop();
      [this.stream, this.faults] = [picture.stream, 0];
    }
    if (this.faults > MOST_FAULTS || (!this.decoder && !picture.key)) return;
    this.silentMs = 0;
    const decoder = this.decoder ?? (this.decoder = this.begin(picture.codec));
    if (decoder.decodeQueueSize > MOST_WAITING) return this.stop(); // until the next key picture
    try {
      decoder.decode(new EncodedVideoChunk({ type: picture.key ? "key" : "delta", timestamp: picture.tUs, data: picture.data }));
    } catch {
      this.fail(decoder);
    }
  }

  /** Time of the room has gone on. */
  pass(ms: number): void {
    this.silentMs += ms;
  }

  /** Whether what was shown is shown no more. */
  silent(): boolean {
    return this.shows && this.silentMs > SILENT_MS;
  }

  end(): void {
    this.stop();
    this.shows = false;
    (this.texture.image as VideoFrame | null)?.close();
    this.texture.image = null;
    this.texture.dispose();
  }

  private begin(codec: string): VideoDecoder {
    const decoder = new VideoDecoder({ output: (frame) => this.show(frame, decoder), error: () => this.fail(decoder) });
    decoder.configure({ codec, optimizeForLatency: true });
    return decoder;
  }

  private show(frame: VideoFrame, decoder: VideoDecoder): void {
    const { displayWidth: width, displayHeight: height } = frame;
    if (this.decoder !== decoder || Math.max(width, height) > SIDE || width * height > PIXELS) return frame.close();
    const before = this.texture.image as VideoFrame | null;
    if (before && (before.displayWidth !== width || before.displayHeight !== height)) this.texture.dispose();
    before?.close();
    this.texture.image = Object.assign(frame, { width, height }); // three.js counts levels of detail by these
    this.texture.needsUpdate = true;
    [this.shows, this.faults] = [true, 0];
    this.drawn++;
    this.changed();
  }

  private fail(decoder: VideoDecoder): void {
    if (this.decoder !== decoder) return;
    this.faults++;
    this.stop();
  }

  private stop(): void {
    if (this.decoder && this.decoder.state !== "closed") this.decoder.close();
    this.decoder = null;
  }
}

export class Screens {
  private readonly screens = new Map<string, Screen>();
  private things: Map<string, { about: ThingRow; node: Group }> = new Map();
  private tMs = 0; // of the room

  /** changed: what is seen is another; anisotropy: of textures, as fine as the graphics card can. */
  constructor(
    private readonly changed: () => void,
    private readonly anisotropy: () => number,
  ) {
    if (canDecode) setInterval(() => this.look(), LOOK_MS);
  }

  /** Pictures of somebody's screen that were decoded here. */
  drawn(participant: string): number {
    return this.screens.get(participant)?.drawn ?? 0;
  }

  /** The room is shown as it was then: time that passes without a picture counts where it passes in the room. */
  at(tMs: number): void {
    const passed = Math.min(LOOK_MS, Math.max(0, tMs - this.tMs));
    this.tMs = tMs;
    for (const screen of this.screens.values()) screen.pass(passed);
  }

  /** Another moment of a log will be shown: what is shown stays only where a picture of that moment comes. */
  leap(): void {
    for (const screen of this.screens.values()) screen.pass(Infinity);
  }

  receive(message: ArrayBuffer): void {
    const picture = canDecode ? pictureOf(message) : null;
    if (picture) this.screens.get(picture.participant)?.take(picture);
  }

  /** Let panels show what they follow, and no other thing. */
  show(things: Map<string, { about: ThingRow; node: Group }>): void {
    this.things = things;
    const live = new Set([...things.values()].flatMap(({ about }) => about.screen ?? []));
    for (const name of live) if (!this.screens.has(name)) this.screens.set(name, this.begin());
    this.paint();
    for (const [name, screen] of this.screens) {
      if (live.has(name)) continue;
      screen.end();
      this.screens.delete(name);
    }
  }

  private begin(): Screen {
    const screen = new Screen(() => this.paint());
    screen.texture.anisotropy = this.anisotropy();
    return screen;
  }

  private look(): void {
    for (const screen of this.screens.values()) {
      if (!screen.silent()) continue;
      screen.shows = false;
      this.paint();
    }
  }

  private paint(): void {
    for (const { about, node } of this.things.values()) {
      const screen = about.screen ? this.screens.get(about.screen) : undefined;
      if (about.screen) paintOn(node, screen?.shows ? screen.texture : null);
    }
    this.changed();
  }
}

const canDecode = typeof VideoDecoder === "function"; // beyond this machine, only with https

/** Show a picture on a panel; null: its page. */
function paintOn(node: Group, picture: Texture | null): void {
  node.traverse((part) => {
    const material = part instanceof Mesh ? part.material : null;
    if (!(material instanceof MeshBasicMaterial)) return;
    const kept = material.userData as { page?: Texture | null };
    kept.page ??= material.map;
    material.map = picture ?? kept.page;
  });
}
