// Which part of a log's time is seen; lanes and plots share it.
export const SHORTEST_S = 0.5; // no less is seen at once

export class Zoom {
  from = 0;
  to = 1;
  private end = 0;
  private whole = true;

  /** changed: called when another part is seen. */
  constructor(private readonly changed: () => void) {}

  get zoomed(): boolean {
    return !this.whole;
  }

  get length(): number {
    return this.to - this.from;
  }

  /** The log lasts until `end` [s]. */
  reach(end: number): void {
    if (end === this.end) return;
    this.end = end;
    if (this.whole) this.show(0, end);
  }

  /** A part, or as much of it as there is. */
  show(from: number, to: number): void {
    const length = Math.min(this.end, Math.max(SHORTEST_S, to - from));
    const begin = Math.min(Math.max(0, from), this.end - length);
    this.whole = length >= this.end - 1e-6;
    if (begin === this.from && begin + length === this.to) return;
    [this.from, this.to] = [begin, begin + length];
    this.changed();
  }

  showAll(): void {
    this.show(0, this.end);
  }

  /** times: as long as now; t stays where it is. */
  zoom(times: number, t: number): void {
    const length = Math.max(SHORTEST_S, this.length * times);
    const share = this.length > 0 ? Math.min(1, Math.max(0, (t - this.from) / this.length)) : 0;
    this.show(t - share * length, t + (1 - share) * length);
  }

  /** share: of what is seen; below 0: earlier. */
  shift(share: number): void {
    this.show(this.from + share * this.length, this.to + share * this.length);
  }

  /** The playhead has come to `t`, by itself. */
  follow(t: number): void {
    if (!this.whole && (t > this.to || t < this.from)) this.show(t, t + this.length);
  }

  /** Where a moment stands, 0 to 1 within what is seen. */
  place(t: number): number {
    return (t - this.from) / Math.max(1e-9, this.length);
  }

  percent(t: number): string {
    return `${(100 * this.place(t)).toFixed(4)}%`;
  }

  /** How much of what is seen a length of time takes. */
  width(seconds: number): string {
    return `${((100 * seconds) / Math.max(1e-9, this.length)).toFixed(4)}%`;
  }

  /** The moment at a place of a box. */
  at(box: DOMRect, x: number): number {
    return this.from + ((x - box.x) / box.width) * this.length;
  }
}
