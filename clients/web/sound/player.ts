// The jitter buffer of one voice: frames of 20 ms in as they come, samples out for the moment at which their picture is seen, or a
// little later, where they come later. What is missing is made of the pitch of what was heard last, and fades.
//
// Where sound is not where it should be, there is one rule: go on elsewhere. In a pause at once, within speech by some milliseconds
// at a time, always to where the wave looks like what would have come.
import type { Sounding } from "../connection/messages";

const PER_MS = 48;
const FRAME = 960; // samples of 20 ms
const FRAME_MS = 20;
const KEPT = 250; // frames behind the newest: pictures may be some seconds late
const FOLLOW = 0.02; // share of an error of a frame's time by which the clock of the frames follows
const NEW_MS = 200; // a frame so far from its place begins a new clock
export const CHUNK = 384; // samples made at once: three blocks of a browser
const FADE = 240;
const STILL = 5 * PER_MS; // a smaller error is left
const STEP = 15 * PER_MS; // the most by which speech goes on elsewhere at once,
const RESTS = 12; // chunks from one step to the next: a tenth of a second
const FAR = 300 * PER_MS; // a larger error is made up at once
const SEARCHED = 4 * PER_MS; // how far a better place is looked for
const QUIET = 0.004; // root mean square of a pause
const LOWEST = 720; // samples of the lowest pitch, 67 Hz,
const HIGHEST = 120; // and of the highest, 400 Hz
const MADE = 5; // chunks that are made up, until there is silence
const SPAN_MS = 500; // late frames come together: the latest of each half second counts,
const SPANS = 20; // for so many of them,
const IGNORED = 10; // one in so many left out, as one is from the third on: a single halt is not waited for
const SPARE_MS = 8; // kept between the arrival of such a frame and its playing

export class Player {
  /** From the clock of pictures to that of the sound that is put out [ms]. */
  clockMs = 0;
  /** From conference time to when the picture of it is seen [ms], of the clock of pictures, without a talker's own delay; null: not
   * known. */
  pictureMs: number | null = null;
  /** Counts, in samples. late: came when their time was over. */
  readonly counts = { played: 0, made: 0, late: 0 };
  private readonly frames = new Map<number, Float32Array>(); // by number
  private newest = -1;
  private anchorMs: number | null = null; // conference time of frame 0
  private delayMs = 0;
  private spans: { number: number; latestMs: number }[] = []; // of arrivals, of the clock of pictures, against conference time
  private neededMs = -Infinity; // that nearly all of them keep to
  private at: number | null = null; // sample that is next; null: there is silence
  private missing = 0; // chunks made up in a row,
  private period = new Float32Array(HIGHEST); // of this
  private rest = 0;
  private readonly heard = new Float32Array(2 * LOWEST); // last

  /** A frame that came at `nowMs` of the clock of sound. */
  put({ capturedMs, delayMs, samples }: Sounding, nowMs: number): void {
    this.delayMs = delayMs;
    const place = this.anchorMs === null ? NaN : (capturedMs - this.anchorMs) / FRAME_MS;
    let number = Math.round(place);
    if (!(Math.abs(place - number) * FRAME_MS < NEW_MS && Math.abs(number - this.newest) < KEPT)) number = this.begin(capturedMs);
    else this.anchorMs! += FOLLOW * (place - number) * FRAME_MS;
    this.came(nowMs, nowMs - this.clockMs - capturedMs);
    if (this.at !== null && (number + 1) * FRAME <= this.at) this.counts.late += FRAME;
    this.frames.set(number, samples);
    this.newest = Math.max(this.newest, number);
    this.frames.delete(number - KEPT);
  }

  /** How much later than its picture what is played now is heard [ms]; null: there is silence. */
  skewMs(nowMs: number): number | null {
    if (this.at === null || this.anchorMs === null || this.pictureMs === null) return null;
    return nowMs - this.clockMs - (this.anchorMs + this.at / PER_MS) - this.delayMs - this.pictureMs;
  }

  /** The next CHUNK samples, to be put out from `nowMs` of the clock of sound on; null: silence. */
  next(nowMs: number): Float32Array | null {
    if (this.anchorMs === null) return null;
    const wantedMs = Math.max(this.pictureMs === null ? -Infinity : this.pictureMs + this.delayMs, this.neededMs);
    const wanted = Math.round((nowMs - this.clockMs - wantedMs - this.anchorMs) * PER_MS);
    const begins = this.at === null;
    if (begins && !this.has(wanted, CHUNK)) return null;
    this.at ??= wanted;
    if (begins) this.missing = 0;
    let out = this.goOn(this.at);
    if (begins) out = faded(new Float32Array(CHUNK), out);
    else if (!this.missing) out = this.stepped(this.at, wanted, out);
    this.heard.copyWithin(0, CHUNK);
    this.heard.set(out, this.heard.length - CHUNK);
    this.at = this.missing < MADE ? this.at + CHUNK : null;
    return out;
  }

  private begin(capturedMs: number): number {
    this.frames.clear();
    this.spans = [];
    this.anchorMs = capturedMs;
    this.at = null;
    return (this.newest = 0);
  }

  private came(nowMs: number, lateMs: number): void {
    const [number, last] = [Math.floor(nowMs / SPAN_MS), this.spans.at(-1)];
    if (last?.number === number) last.latestMs = Math.max(last.latestMs, lateMs);
    else this.spans = [...this.spans, { number, latestMs: lateMs }].slice(-SPANS);
    const ignored = this.spans.length < 3 ? 0 : Math.max(1, Math.floor(this.spans.length / IGNORED));
    this.neededMs = this.spans.map((span) => span.latestMs).sort((a, b) => b - a)[ignored]! + SPARE_MS;
  }

  private has(from: number, count: number): boolean {
    for (let n = Math.floor(from / FRAME); n * FRAME < from + count; n++) if (!this.frames.has(n)) return false;
    return true;
  }

  private copy(from: number, count: number): Float32Array {
    const out = new Float32Array(count);
    for (let n = Math.floor(from / FRAME); n * FRAME < from + count; n++) {
      const [low, high] = [Math.max(from, n * FRAME), Math.min(from + count, (n + 1) * FRAME)];
      out.set(this.frames.get(n)!.subarray(low - n * FRAME, high - n * FRAME), low - from);
    }
    return out;
  }

  /** What comes at a place: what was said, or, where that is missing, what is made up. */
  private goOn(at: number): Float32Array {
    const there = this.has(at, CHUNK);
    if (there && !this.missing) {
      this.counts.played += CHUNK;
      return this.copy(at, CHUNK);
    }
    const made = this.madeUp();
    if (there) {
      this.missing = 0;
      this.counts.played += CHUNK;
      return faded(made, this.copy(at, CHUNK));
    }
    this.missing++;
    if (loudness(made) > 0) this.counts.made += CHUNK;
    return made;
  }

  /** What was heard last, period by period, ever softer; nothing after a pause. */
  private madeUp(): Float32Array {
    const { heard, missing } = this;
    const [out, end] = [new Float32Array(CHUNK), heard.length];
    if (!missing) {
      const pause = loudness(heard.subarray(end - CHUNK)) < QUIET;
      const lag = (n: number) => alike(heard.subarray(end - LOWEST), heard.subarray(end - LOWEST - n, end - n));
      this.period = pause ? new Float32Array(HIGHEST) : heard.slice(end - best(HIGHEST, LOWEST, lag));
    }
    for (let n = 0; n < CHUNK; n++) {
      const at = missing * CHUNK + n;
      out[n] = this.period[at % this.period.length]! * Math.max(0, 1 - at / (MADE * CHUNK));
    }
    return out;
  }

  /** What is played where `out` would be, nearer to where it should be; moves there. */
  private stepped(at: number, wanted: number, out: Float32Array): Float32Array {
    const error = wanted - at;
    this.rest--;
    if (Math.abs(error) < STILL) return out;
    const whole = Math.abs(error) > FAR || this.silentFrom(Math.min(at, wanted), Math.max(at, wanted) + CHUNK);
    if (!whole && this.rest > 0) return out;
    const near = at + (whole ? error : Math.max(-STEP, Math.min(STEP, error)));
    if (!this.has(near - SEARCHED, 2 * SEARCHED + CHUNK)) return out;
    const around = this.copy(near - SEARCHED, 2 * SEARCHED + CHUNK);
    const shift = best(0, 2 * SEARCHED, (n) => alike(out.subarray(0, FADE), around.subarray(n, n + FADE)));
    this.at = near - SEARCHED + shift;
    this.rest = RESTS;
    return faded(out, around.slice(shift, shift + CHUNK));
  }

  private silentFrom(from: number, to: number): boolean {
    return this.has(from, to - from) && loudness(this.copy(from, to - from)) < QUIET;
  }
}

/** From one to the other. */
function faded(one: Float32Array, other: Float32Array): Float32Array {
  for (let n = 0; n < FADE; n++) other[n] = one[n]! + ((other[n]! - one[n]!) * n) / FADE;
  return other;
}

function loudness(samples: Float32Array): number {
  return Math.sqrt(samples.reduce((sum, x) => sum + x * x, 0) / samples.length);
}

/** How much two waves look like each other, at every second sample. */
function alike(one: Float32Array, other: Float32Array): number {
  let [both, power] = [0, 1e-9];
  for (let n = 0; n < one.length; n += 2) {
    both += one[n]! * other[n]!;
    power += other[n]! * other[n]!;
  }
  return both / Math.sqrt(power);
}

/** The number for which something is largest. */
function best(from: number, to: number, value: (n: number) => number): number {
  let [found, most] = [from, -Infinity];
  for (let n = from; n <= to; n++) {
    const now = value(n);
    if (now > most) [found, most] = [n, now];
  }
  return found;
}
