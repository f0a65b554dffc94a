// The timeline of a log: lanes of what happened, the playhead, and what moves it.
import { render } from "preact";
import { type Event, type Lanes, type Playhead, type Span, clockText, edges, filled } from "./lanes";

const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 4, 8, 16];
const FRAME_S = 1 / 60; // a step: motion has 60 frames a second
const JUMP_S = 5;
const KINDS = ["touch", "grasp", "word", "command"] as const;
type Kind = (typeof KINDS)[number];

export interface Asked {
  t?: number;
  speed?: number;
  playing?: boolean;
  loop?: [number, number] | null;
}

export class Timeline {
  private head: Playhead | null = null;
  private lanes: Lanes | null = null;
  private dragged: number | null = null; // where the hand holds the playhead [s]
  private waiting = false; // for the picture of where the hand is
  private loopFrom: number | null = null;
  private damage: string[] = [];
  private grows = false;
  private asked = 0;
  private cost = 0;
  private toLive: (() => void) | null = null;

  constructor(
    private readonly parent: HTMLElement,
    private readonly send: (asked: Asked) => void,
  ) {
    addEventListener("keydown", (event) => this.key(event));
    addEventListener("hashchange", () => this.goToAddress());
  }

  /** A log is seen from now on. live: what goes back to the live room; null: there is none. */
  begin(damage: string[], grows: boolean, live: (() => void) | null): void {
    this.damage = damage;
    this.grows = grows;
    this.toLive = live;
    this.lanes = null;
    this.parent.hidden = false;
    if (!live) this.goToAddress();
    this.show();
  }

  end(): void {
    this.parent.hidden = true;
    this.head = null;
  }

  receiveHead(head: Playhead): void {
    this.head = head;
    if (this.waiting && this.dragged !== null && Math.abs(head.t - this.dragged) < 2e-3) {
      this.cost = performance.now() - this.asked;
      this.waiting = false;
    }
    if (!this.waiting && !this.holding) this.dragged = null;
    this.show();
  }

  receiveLanes(lanes: Lanes): void {
    this.lanes = lanes;
    this.show();
  }

  /** From the hand's rest to the message of its picture, the last time [ms]. */
  get scrubMs(): number {
    return this.cost;
  }

  get t(): number {
    return this.dragged ?? this.head?.t ?? 0;
  }

  get playing(): boolean {
    return this.head?.playing ?? false;
  }

  goTo(t: number): void {
    this.dragged = Math.min(this.end_s, Math.max(0, t));
    this.waiting = true;
    this.asked = performance.now();
    this.send({ t: this.dragged });
    this.remember();
    this.show();
  }

  private holding = false;

  private get end_s(): number {
    return this.head?.end ?? this.lanes?.end ?? 0;
  }

  private goToAddress(): void {
    const t = Number(new URLSearchParams(location.hash.slice(1)).get("t") ?? Number.NaN);
    if (Number.isFinite(t)) this.send({ t });
  }

  private remember(): void {
    if (!this.toLive) history.replaceState(null, "", `#t=${this.t.toFixed(2)}`);
  }

  private toggle(): void {
    this.send({ playing: !this.playing });
    this.remember();
  }

  private faster(by: number): void {
    const now = SPEEDS.indexOf(this.head?.speed ?? 1);
    this.send({ speed: SPEEDS[Math.min(SPEEDS.length - 1, Math.max(0, now + by))] });
  }

  private step(by: number): void {
    if (this.playing) this.send({ playing: false });
    this.goTo(this.t + by);
  }

  /** To the beginning of the next (or, by -1, the one before) of a kind. */
  private jump(kind: Kind, by = 1): void {
    const times = this.times(kind);
    const near = 0.02;
    const found = by > 0 ? times.find((t) => t > this.t + near) : times.findLast((t) => t < this.t - near);
    if (found !== undefined) this.goTo(found);
  }

  private times(kind: Kind): number[] {
    const lanes = this.lanes;
    if (!lanes) return [];
    if (kind === "touch") return edges(lanes.touches);
    if (kind === "grasp") return edges(lanes.grasps);
    return lanes.events.filter((e) => (kind === "word" ? e.kind === "utterance" : e.kind === "command")).map((e) => e.t);
  }

  private markLoop(): void {
    if (this.head?.loop) this.send({ loop: null });
    else if (this.loopFrom === null) this.loopFrom = this.t;
    else {
      this.send({ loop: [this.loopFrom, this.t] });
      this.loopFrom = null;
    }
    this.show();
  }

  private key(event: KeyboardEvent): void {
    const on = event.target as HTMLElement;
    if (this.parent.hidden || event.ctrlKey || event.metaKey || event.altKey || /^(INPUT|TEXTAREA|SELECT)$/.test(on.tagName)) return;
    const back = event.shiftKey ? -1 : 1;
    const does: Record<string, () => void> = {
      ",": () => this.step(-FRAME_S),
      ".": () => this.step(FRAME_S),
      j: () => this.goTo(this.t - JUMP_S),
      k: () => this.toggle(),
      l: () => this.goTo(this.t + JUMP_S),
      "[": () => this.faster(-1),
      "]": () => this.faster(1),
      o: () => this.markLoop(),
      t: () => this.jump("touch", back),
      g: () => this.jump("grasp", back),
      w: () => this.jump("word", back),
      c: () => this.jump("command", back),
      home: () => this.goTo(0),
      end: () => this.goTo(this.end_s),
    };
    if (event.key === " " && on.tagName !== "BUTTON") does[" "] = () => this.toggle();
    const act = does[event.key.toLowerCase()];
    if (!act) return;
    event.preventDefault();
    act();
  }

  private held(event: PointerEvent): void {
    const box = (event.currentTarget as HTMLElement).getBoundingClientRect();
    this.goTo(((event.clientX - box.x) / box.width) * this.end_s);
  }

  private show(): void {
    const { head, lanes } = this;
    if (!head) return;
    const at = (t: number) => `${((100 * t) / Math.max(1e-9, this.end_s)).toFixed(3)}%`;
    render(
      <>
        <div class="moves">
          <button type="button" class="play" aria-label={head.playing ? "Pause (k)" : "Play (k)"} title="Space or k" onClick={() => this.toggle()}>
            {head.playing ? "❚❚" : "▶"}
          </button>
          <button type="button" title="," aria-label="One frame back" onClick={() => this.step(-FRAME_S)}>
            −1
          </button>
          <button type="button" title="." aria-label="One frame on" onClick={() => this.step(FRAME_S)}>
            +1
          </button>
          <output class="time">
            {clockText(this.t)} <small>of {clockText(this.end_s)}</small>
          </output>
          <label>
            <span class="unseen">Speed</span>
            <select value={String(head.speed)} onChange={(e) => this.send({ speed: Number(e.currentTarget.value) })}>
              {[...new Set([...SPEEDS, head.speed])].map((s) => (
                <option key={s} value={String(s)}>
                  {s}×
                </option>
              ))}
            </select>
          </label>
          <button type="button" title="o" aria-pressed={Boolean(head.loop) || this.loopFrom !== null} onClick={() => this.markLoop()}>
            {head.loop ? "End loop" : this.loopFrom === null ? "Loop from here" : "Loop to here"}
          </button>
          <span class="jumps">
            {KINDS.map((kind) => (
              <button type="button" key={kind} title={`${kind[0]}, with Shift back`} disabled={!this.times(kind).length} onClick={() => this.jump(kind)}>
                Next {kind}
              </button>
            ))}
          </span>
          {this.toLive && (
            <button type="button" class="live" onClick={this.toLive}>
              Back to live
            </button>
          )}
        </div>
        <div class="lanes">
          <Names lanes={lanes} />
          <div
            class="tracks"
            role="slider"
            tabIndex={0}
            aria-label="Moment of the log"
            aria-valuemin={0}
            aria-valuemax={this.end_s}
            aria-valuenow={this.t}
            aria-valuetext={clockText(this.t)}
            onPointerDown={(e) => {
              e.currentTarget.setPointerCapture(e.pointerId);
              this.holding = true;
              this.held(e);
            }}
            onPointerMove={(e) => this.holding && this.held(e)}
            onPointerUp={() => (this.holding = false)}
            onPointerCancel={() => (this.holding = false)}
            onKeyDown={(e) => {
              const by = { ArrowLeft: -1, ArrowRight: 1 }[e.key];
              if (by) this.goTo(this.t + by);
            }}
          >
            {head.loop && <i class="loop" style={{ left: at(head.loop[0]), width: at(head.loop[1] - head.loop[0]) }} />}
            {lanes && <Tracks lanes={lanes} at={at} />}
            <i class="head" style={{ left: at(this.t) }} />
          </div>
        </div>
        <p class="said" aria-live="polite">
          {this.saying(lanes, head)}
        </p>
      </>,
      this.parent,
    );
  }

  private saying(lanes: Lanes | null, head: Playhead): string {
    const now = lanes?.events.findLast((e) => e.t <= this.t && e.t > this.t - 3);
    const parts: string[] = now ? [`${now.who}: ${now.text}`] : [];
    if (!lanes || lanes.done < 1) parts.push(`lanes: ${Math.round(100 * (lanes?.done ?? 0))} % of the log read`);
    if (lanes?.left_out) parts.push(`${lanes.left_out} more events than shown`);
    if (this.grows && this.toLive) parts.push("being recorded");
    else parts.push(...(lanes?.damage.length ? lanes.damage : this.damage));
    if (head.t >= head.end && !this.toLive) parts.push("end of the log");
    return parts.join(" · ");
  }
}

function Names({ lanes }: { lanes: Lanes | null }) {
  return (
    <div class="names" aria-hidden="true">
      {(lanes ? rows(lanes) : [["reading…", null]] as const).map(([name]) => (
        <span key={name}>{name}</span>
      ))}
    </div>
  );
}

function Tracks({ lanes, at }: { lanes: Lanes; at: (t: number) => string }) {
  return (
    <>
      {rows(lanes).map(([name, row]) => (
        <div class="track" key={name}>
          {row.energy && (
            <svg viewBox={`0 0 ${row.energy.length} 1`} preserveAspectRatio="none" aria-hidden="true">
              <path d={filled(row.energy)} />
            </svg>
          )}
          {row.talks && row.talks.map(([a, b]) => <i key={a} class="talks" style={{ left: at(a), width: at(b - a) }} />)}
          {row.spans?.map(([a, b, what], n) => (
            <i key={n} class={row.kind} title={what} style={{ left: at(a), width: at(b - a) }} />
          ))}
          {row.points?.map((p, n) => (
            <b key={n} class={row.kind} title={`${p.who} ${p.text}`} style={{ left: at(p.t) }} />
          ))}
        </div>
      ))}
    </>
  );
}

interface Row {
  energy?: number[];
  talks?: [number, number][];
  spans?: Span[];
  points?: Pick<Event, "t" | "who" | "text">[];
  kind?: string;
}

function rows(lanes: Lanes): (readonly [string, Row])[] {
  const talks = (who: string) => {
    const of = lanes.voices.find((v) => v.name === who)?.talks ?? [];
    const bin = lanes.end / of.length;
    return of.flatMap((on, n): [number, number][] => (on && !of[n - 1] ? [[n * bin, (of.indexOf(0, n) < 0 ? of.length : of.indexOf(0, n)) * bin]] : []));
  };
  const out: (readonly [string, Row])[] = lanes.people.map((p) => [p.name, { energy: p.energy, talks: talks(p.name) }]);
  out.push(["touches", { spans: lanes.touches, kind: "touch" }], ["grasps", { spans: lanes.grasps, kind: "grasp" }]);
  out.push(["words, commands", { points: lanes.events, kind: "event" }]);
  if (lanes.gaps.length || lanes.faults.length)
    out.push(["gaps, faults", { spans: lanes.gaps, points: lanes.faults.map(([t, text]) => ({ t, who: "", text })), kind: "gap" }]);
  return out;
}
