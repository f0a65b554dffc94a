// The WebSocket, which comes back by itself, and what the conference's clock says.
import { packetOf, type Packet, type Words } from "./messages";

const SILENT_MS = 4000; // something is said every second
const PING_MS = 2000;
const PINGS = 10;
const FIRST_WAIT_MS = 500;
const MOST_WAIT_MS = 5000;
const ENDED = 1001; // what the renderer closes with when it ends
const UNREACHED = 1006; // nobody is there, or nobody any more
const LOST = "The picture does not come; trying again.";

export interface Listener {
  words(words: Words): void;
  packet(packet: Packet): void;
  /** text: why nothing comes; null: it does. */
  trouble(text: string | null): void;
}

export class Connection {
  private socket: WebSocket | null = null;
  private wait = FIRST_WAIT_MS;
  private heardAt = 0;
  private ended = false;
  private pings: { trip: number; offset: number }[] = [];

  constructor(
    private readonly address: string,
    private readonly listener: Listener,
  ) {
    this.open();
    setInterval(() => this.look(), PING_MS);
  }

  /** Conference time now [ms], NaN while it is not known. */
  now(): number {
    if (this.pings.length === 0) return NaN;
    const best = this.pings.reduce((a, b) => (b.trip < a.trip ? b : a));
    return performance.now() + best.offset;
  }

  private open(): void {
    const socket = new WebSocket(this.address);
    socket.binaryType = "arraybuffer";
    this.socket = socket;
    this.heardAt = performance.now();
    socket.onopen = () => this.ping();
    socket.onmessage = (event: MessageEvent<string | ArrayBuffer>) => {
      this.heardAt = performance.now();
      this.wait = FIRST_WAIT_MS;
      if (typeof event.data === "string") this.hear(JSON.parse(event.data) as Words);
      else this.listener.packet(packetOf(event.data));
    };
    socket.onclose = (event) => {
      if (this.socket !== socket) return;
      this.socket = null;
      this.pings = [];
      this.ended = event.code === ENDED || (this.ended && event.code === UNREACHED);
      this.listener.trouble(this.ended ? "The conference has ended. This page waits for the next one." : LOST);
      setTimeout(() => this.open(), this.wait);
      this.wait = Math.min(2 * this.wait, MOST_WAIT_MS);
    };
  }

  private hear(words: Words): void {
    if (words.kind === "pong") {
      const now = performance.now();
      const trip = now - words.ping;
      this.pings.push({ trip, offset: words.t_ms + trip / 2 - now });
      if (this.pings.length > PINGS) this.pings.shift();
    } else if (words.kind === "hello") {
      this.ended = false;
      this.listener.trouble(null);
    }
    this.listener.words(words);
  }

  /** Something for the renderer, where it is there. */
  say(words: { ping: number } | { lost: true }): void {
    if (this.socket?.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(words));
  }

  private ping(): void {
    this.say({ ping: performance.now() });
  }

  private look(): void {
    if (this.socket && performance.now() - this.heardAt > SILENT_MS) this.socket.close();
    this.ping();
  }
}
