// What is known of a whole log (vistel/log/lanes.py), and how it is drawn.
export type Span = [number, number, string]; // from, to [s], what

export interface Playhead {
  kind: "playhead";
  t: number; // seconds after the log's beginning
  end: number;
  speed: number;
  playing: boolean;
  loop: [number, number] | null;
  leaps: number; // how often it has gone elsewhere
  asked: number; // what this page asked last, when this was said: its number
}
export interface Event {
  t: number;
  kind: "utterance" | "command" | "bond_torn" | "button";
  who: string;
  text: string;
}
export interface Lanes {
  kind: "lanes";
  done: number; // share of the log that has been read
  end: number;
  people: { name: string; energy: number[] }[]; // of the most
  voices: { name: string; talks: number[] }[];
  touches: Span[];
  grasps: Span[];
  events: Event[];
  gaps: Span[];
  faults: [number, string][];
  left_out: number;
  damage: string[];
}

/** The times at which spans begin, each once. */
export function edges(spans: Span[]): number[] {
  return [...new Set(spans.map(([begin]) => begin))].sort((a, b) => a - b);
}

/** An area of heights 0 to 1, as wide as there are of them. */
export function filled(heights: number[]): string {
  return `M0 1${heights.map((h, n) => `L${n} ${(1 - Math.sqrt(h)).toFixed(3)}L${n + 1} ${(1 - Math.sqrt(h)).toFixed(3)}`).join("")}L${heights.length} 1Z`;
}

const STEPS = [0.1, 0.2, 0.5, 1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 900, 1800, 3600, 7200, 14400, 43200, 86400]; // [s]

/** Round times within a part of a log, at most so many, and how each is written; there is room to write it before the end. */
export function ruled(from: number, to: number, most: number): [number, string][] {
  const step = STEPS.find((s) => (to - from) / s <= most) ?? STEPS.at(-1)!;
  const out: [number, string][] = [];
  const last = to - (0.6 * (to - from)) / most;
  for (let n = Math.ceil(from / step - 1e-9); n * step <= last && out.length < most; n++) {
    const whole = clockText(n * step);
    out.push([n * step, step < 1 ? whole.slice(0, -1) : whole.slice(0, -3)]);
  }
  return out;
}

/** "1:02:03.4". */
export function clockText(t: number): string {
  const hours = Math.floor(t / 3600);
  const minutes = Math.floor(t / 60) % 60;
  const seconds = (t % 60).toFixed(2).padStart(5, "0");
  return hours ? `${hours}:${String(minutes).padStart(2, "0")}:${seconds}` : `${minutes}:${seconds}`;
}
