// The page's connection to the console, as the page sees it: a worker holds it, with all sound that comes and goes, so that a page
// which is busy with pictures holds up no voice.
import type { Words } from "../console/wire";
import type { FromWorker, ToWorker } from "./messages";

export interface Listener {
  words(words: Words): void;
  frame(data: ArrayBuffer): void;
  screen(data: ArrayBuffer): void;
  trouble(text: string | null): void;
  /** Somebody's voice has come, and comes out of this port from now on. */
  talker(name: string, port: MessagePort): void;
  /** Nothing has come of it for long. */
  silent(name: string): void;
  spoken?(level: number, bytes: number): void;
  speechless?(): void;
}

export class Link {
  private readonly worker = new Worker("connection.js", { type: "module" });
  private readonly talkers = new Set<string>();
  private readonly look = () => document.hidden || this.tell({ kind: "look" });

  /** first: what is said first, each time the connection is there. */
  constructor(address: string, private readonly listener: Listener, first?: string) {
    this.worker.onmessage = ({ data }: MessageEvent<FromWorker>) => {
      if (data.kind === "words") listener.words(data.words);
      else if (data.kind === "frame") this.tell({ kind: "next" }), listener.frame(data.data);
      else if (data.kind === "screen") listener.screen(data.data);
      else if (data.kind === "trouble") listener.trouble(data.text);
      else if (data.kind === "talker") this.talkers.add(data.name), listener.talker(data.name, data.port);
      else if (data.kind === "silent") this.talkers.delete(data.name), listener.silent(data.name);
      else if (data.kind === "spoken") listener.spoken?.(data.level, data.bytes);
      else listener.speechless?.();
    };
    this.tell({ kind: "open", address, first });
    document.addEventListener("visibilitychange", this.look); // a tab that was asleep finds out at once
  }

  /** Nothing is kept for later: what cannot be sent now is left out. */
  send(data: string | ArrayBuffer): void {
    this.tell({ kind: "send", data });
  }

  tell(said: ToWorker, transfer: Transferable[] = []): void {
    this.worker.postMessage(said, transfer);
  }

  /** Come back no more. */
  close(): void {
    document.removeEventListener("visibilitychange", this.look);
    this.worker.terminate();
    for (const name of this.talkers) this.listener.silent(name);
  }
}
