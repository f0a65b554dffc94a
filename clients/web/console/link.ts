// The WebSocket, which comes back by itself.
import type { Words } from "./wire";

const SILENT_MS = 5000; // while somebody watches, something comes thirty times a second
const LOOK_MS = 1000;
const FIRST_WAIT_MS = 500;
const MOST_WAIT_MS = 5000;
const FINAL = 4400; // with such a code and above, there is nothing to come back to (services/vistel_services/console/guests.py)
const ENDED = 1001; // what the console closes with when the conference ends

export interface Listener {
  words(words: Words): void;
  frame(data: ArrayBuffer): void;
  /** text: why nothing comes; null: it does. */
  trouble(text: string | null): void;
}

export class Link {
  private socket: WebSocket | null = null;
  private wait = FIRST_WAIT_MS;
  private heardAt = 0;
  private ended = false;
  private over = false;
  private later = 0;

  constructor(
    private readonly address: string,
    private readonly listener: Listener,
    private readonly first?: string, // what is said first
  ) {
    this.open();
    setInterval(() => this.look(), LOOK_MS);
    addEventListener("online", () => this.again());
    // A tab that was asleep finds out at once.
    document.addEventListener("visibilitychange", () => document.hidden || this.look());
  }

  private open(): void {
    const socket = new WebSocket(this.address);
    socket.binaryType = "arraybuffer";
    this.socket = socket;
    this.heardAt = performance.now();
    socket.onmessage = (event: MessageEvent<string | ArrayBuffer>) => {
      this.heardAt = performance.now();
      this.wait = FIRST_WAIT_MS;
      if (typeof event.data !== "string") return this.listener.frame(event.data);
      const words = JSON.parse(event.data) as Words;
      if (words.kind === "hello") {
        this.ended = false;
        this.listener.trouble(null);
      }
      this.listener.words(words);
    };
    socket.onopen = () => this.first !== undefined && socket.send(this.first);
    socket.onclose = (event) => {
      if (this.socket !== socket) return;
      this.socket = null;
      if (event.code >= FINAL) return void (this.over = true);
      this.ended ||= event.code === ENDED;
      this.listener.trouble(this.ended ? "The conference has ended. This page waits for the next one." : "Nothing comes; trying again.");
      this.later = window.setTimeout(() => this.open(), this.wait);
      this.wait = Math.min(2 * this.wait, MOST_WAIT_MS);
    };
  }

  /** Nothing is kept for later: what cannot be sent now is left out. */
  send(data: string | ArrayBuffer): void {
    if (this.socket?.readyState === WebSocket.OPEN) this.socket.send(data);
  }

  /** Come back no more. */
  close(): void {
    this.over = true;
    clearTimeout(this.later);
    const socket = this.socket;
    this.socket = null;
    socket?.close();
  }

  private again(): void {
    if (this.socket || this.over) return;
    clearTimeout(this.later);
    this.open();
  }

  private look(): void {
    if (this.socket && performance.now() - this.heardAt > SILENT_MS) this.socket.close();
  }
}
