// The WebSocket, which comes back by itself; it lives in a worker.
import type { Words } from "../console/wire";
import { TROUBLE } from "./trouble";

const LOOK_MS = 1000;
const MOST_UNHEARD = 5; // looks at which nothing had come since the one before: while somebody watches, frames come all the time
const FIRST_WAIT_MS = 500;
const MOST_WAIT_MS = 5000;
const FINAL = 4400; // with such a code and above, there is nothing to come back to (services/vistel_services/console/guests.py)
const TAKEN = 4409; // by another page, or by this one's connection before, of which the console does not know yet that it is gone
const ENDED = 1001; // what the console closes with when the conference ends

export interface Listener {
  words(words: Words): void;
  data(data: ArrayBuffer): void;
  /** text: why nothing comes; null: it does. */
  trouble(text: string | null): void;
}

export class Socket {
  private socket: WebSocket | null = null;
  private wait = FIRST_WAIT_MS;
  private unheard = 0; // looks, not time: after a halt of the machine, what has come meanwhile is taken first
  private ended = false;
  private over = false;
  private been = false; // it was open
  private later: ReturnType<typeof setTimeout> | undefined;

  constructor(
    private readonly address: string,
    private readonly listener: Listener,
    private readonly first?: string, // what is said first
  ) {
    this.open();
    setInterval(() => this.look(), LOOK_MS);
    addEventListener("online", () => this.again());
  }

  private open(): void {
    const socket = new WebSocket(this.address);
    socket.binaryType = "arraybuffer";
    this.socket = socket;
    this.unheard = 0;
    socket.onmessage = (event: MessageEvent<string | ArrayBuffer>) => {
      this.unheard = 0;
      if (typeof event.data !== "string") return this.listener.data(event.data);
      const words = JSON.parse(event.data) as Words;
      if (words.kind === "refused" && words.code === TAKEN && this.been) return;
      if (words.kind === "hello") {
        [this.ended, this.been, this.wait] = [false, true, FIRST_WAIT_MS];
        this.listener.trouble(null);
      }
      this.listener.words(words);
    };
    socket.onopen = () => this.first !== undefined && socket.send(this.first);
    socket.onclose = (event) => {
      if (this.socket !== socket) return;
      this.socket = null;
      if (event.code >= FINAL && !(event.code === TAKEN && this.been)) return void (this.over = true);
      this.ended ||= event.code === ENDED;
      this.listener.trouble(this.ended ? TROUBLE.over : TROUBLE.again);
      this.later = setTimeout(() => this.open(), this.wait);
      this.wait = Math.min(2 * this.wait, MOST_WAIT_MS);
    };
  }

  /** Nothing is kept for later: what cannot be sent now is left out. */
  send(data: string | ArrayBuffer): void {
    if (this.socket?.readyState === WebSocket.OPEN) this.socket.send(data);
  }

  private again(): void {
    if (this.socket || this.over) return;
    clearTimeout(this.later);
    this.open();
  }

  /** Whether it still lives; one that does not is opened anew. */
  look(): void {
    if (++this.unheard > MOST_UNHEARD) this.socket?.close();
  }
}
