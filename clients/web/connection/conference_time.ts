// Conference time as this page knows it: the gateway is asked now and then, and the quickest of the last answers counts. What is
// said by it goes on evenly: a better answer is followed slowly, unless it is far off.
const ASK_MS = 2000;
const SOON_MS = 150; // while few answers have come
const KEPT = 15;
const SLEW = 0.005; // the most by which this time goes faster or slower
const FAR_MS = 100; // more is made up at once

export class ConferenceTime {
  private readonly answers: { took: number; offset: number }[] = [];
  private offset: number | null = null;
  private askedFor = 0;

  constructor(private readonly ask: (words: string) => void) {
    this.go();
  }

  /** An answer: when it was asked for (of `performance`), and conference time then [ms]. */
  hear(asked: number, ms: number): void {
    const took = performance.now() - asked;
    if (!(took >= 0)) return;
    this.answers.push({ took, offset: ms - asked - took / 2 });
    if (this.answers.length > KEPT) this.answers.shift();
  }

  /** Conference time at a time of `performance` [ms]; null until it is known. */
  at(ms: number): number | null {
    const best = this.answers.reduce<{ took: number; offset: number } | null>((a, b) => (a && a.took <= b.took ? a : b), null);
    if (!best) return null;
    const now = performance.now();
    const most = SLEW * (now - this.askedFor);
    const error = best.offset - (this.offset ?? Infinity);
    this.offset = Math.abs(error) > FAR_MS ? best.offset : this.offset! + Math.max(-most, Math.min(most, error));
    this.askedFor = now;
    return ms + this.offset;
  }

  private go(): void {
    this.ask(JSON.stringify({ time: performance.now() }));
    setTimeout(() => this.go(), this.answers.length < 5 ? SOON_MS : ASK_MS);
  }
}
