// What a guest asks of the room, one thing after the other, each with a number: what went into a connection that had broken is asked
// again once it is back, in the same order, and the gateway does it once.

const APART_MS = 120; // from one to the next: the world takes ten commands a second
const KEPT_MS = 60_000; // what was asked longer ago is not asked again

export class Asks {
  private unheard: { n: number; text: string; at: number }[] = [];
  private number = 0;
  private sent = 0; // the number of the last one that went into this connection
  private sentAt = -Infinity;

  constructor(private readonly send: (text: string) => void) {}

  ask(said: object): void {
    this.number += 1;
    this.unheard.push({ n: this.number, text: JSON.stringify({ ...said, n: this.number }), at: performance.now() });
    this.step();
  }

  /** The gateway has heard all up to the n-th. */
  hear(n: number): void {
    this.unheard = this.unheard.filter((asked) => asked.n > n);
  }

  /** The connection is back after a break. False where something is not asked again, because it was asked too long ago. */
  again(): boolean {
    const all = this.unheard.length;
    this.unheard = this.unheard.filter(({ at }) => performance.now() - at < KEPT_MS);
    this.sent = 0;
    this.step();
    return this.unheard.length === all;
  }

  /** Send what is next. To be called often. */
  step(): void {
    const next = this.unheard.find(({ n }) => n > this.sent);
    if (!next || performance.now() - this.sentAt < APART_MS) return;
    this.send(next.text);
    [this.sent, this.sentAt] = [next.n, performance.now()];
  }
}
