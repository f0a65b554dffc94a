// The timeline of a log: lanes of what happened, the playhead, and what moves it.
import { render } from "preact";
import { useMemo } from "preact/hooks";
import { Export } from "./export";
import { type Event, type Lanes, type Playhead, type Span, clockText, edges, filled, ruled } from "./lanes";
import { type PlotAsked, wheeled } from "./plots";
import { text } from "./words";
import type { Hello, Note } from "./wire";
import type { Zoom } from "./zoom";

const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 4, 8, 16];
const FRAME_S = 1 / 60; // a step: motion has 60 frames a second
const JUMP_S = 5;
const NEARER = 0.5; // with one press of a key
const TICK_PX = 90; // from one time of the ruler to the next, at least
const KINDS = ["touch", "grasp", "word", "command", "note"] as const;
type Kind = (typeof KINDS)[number];

export interface Asked {
  t?: number;
  speed?: number;
  playing?: boolean;
  loop?: [number, number] | null;
  hears?: boolean;
  offset?: number;
  fields?: true;
  note?: string;
  author?: string;
  plot?: PlotAsked;
  n?: number; // of what is asked: the playhead says which one was heard last
}

/** What moves the playhead. */
type Moves = Pick<Asked, "t" | "speed" | "playing" | "loop">;

export class Timeline {
  private head: Playhead | null = null;
  private lanes: Lanes | null = null;
  private notes: Note[] = [];
  private dragged: number | null = null; // where the hand holds the playhead [s]
  private unheard: Moves = {}; // what was asked and is not known to be heard
  private asks = 0;
  private loopFrom: number | null = null;
  private damage: string[] = [];
  private grows = false;
  private movedAt: number | null = null; // when the hand moved the playhead, until the picture of it comes [ms]
  private cost = 0;
  private toLive: (() => void) | null = null;
  private beside: { name: string; offset: number } | null = null; // the log that is seen, too, and how much later all is there [s]
  private path = "";
  private people: string[] = [];
  sound = false; // somebody wants to hear the log

  constructor(
    private readonly parent: HTMLElement,
    private readonly zoom: Zoom,
    private readonly send: (asked: Asked) => void,
    private readonly remember: () => void, // what is seen, in the address
    private readonly plotted: () => readonly string[],
  ) {
    addEventListener("keydown", (event) => this.key(event));
    addEventListener("hashchange", () => this.goToAddress());
  }

  /** A log is seen from now on. live: what goes back to the live room; null: there is none. */
  begin({ damage, grows, beside, offset, path, people }: Hello, live: (() => void) | null): void {
    this.damage = damage ?? [];
    this.grows = grows ?? false;
    const back = this.head && path === this.path ? this.head : null; // the connection to this log was lost, and has come back
    const shifted = back && beside && beside === this.beside?.name ? this.beside.offset : undefined;
    this.path = path ?? "";
    this.people = people ?? [];
    this.beside = beside ? { name: beside, offset: shifted ?? offset ?? 0 } : null;
    this.toLive = live;
    if (!back) [this.unheard, this.dragged] = [{}, null];
    this.lanes = null;
    this.notes = [];
    if (back) this.ask({ t: this.t, speed: back.speed, loop: back.loop, playing: back.playing }, shifted);
    else if (!live) this.goToAddress();
    this.show();
  }

  end(): void {
    this.head = null;
  }

  receiveHead(said: Playhead): void {
    if (said.asked >= this.asks) {
      this.unheard = {};
      if (this.movedAt !== null) this.cost = performance.now() - this.movedAt;
      this.movedAt = null;
      if (!this.holding) this.dragged = null;
    }
    const head = { ...said, ...this.unheard }; // what was said before a wish was heard does not undo it
    this.head = head;
    this.zoom.reach(head.end);
    if (head.playing) this.zoom.follow(head.t);
    this.show();
  }

  receiveLanes(lanes: Lanes): void {
    this.lanes = lanes;
    this.show();
  }

  receiveNotes(notes: Note[]): void {
    this.notes = notes;
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
    if (!this.holding) this.zoom.follow(this.dragged);
    this.movedAt = performance.now();
    this.ask({ t: this.dragged });
    this.remember();
  }

  /** Move the playhead. What is asked holds until it is heard, though the connection break meanwhile. */
  ask(moves: Moves, offset?: number): void {
    this.unheard = { ...this.unheard, ...moves };
    if (this.head) this.head = { ...this.head, ...moves };
    this.send({ ...moves, offset, n: ++this.asks });
    this.show();
  }

  private holding = false;

  private get end_s(): number {
    return this.head?.end ?? this.lanes?.end ?? 0;
  }

  private goToAddress(): void {
    const t = Number(new URLSearchParams(location.hash.slice(1)).get("t") ?? Number.NaN);
    if (Number.isFinite(t)) this.ask({ t });
  }

  private toggle(): void {
    this.ask({ playing: !this.playing });
    this.remember();
  }

  private faster(by: number): void {
    const now = SPEEDS.indexOf(this.head?.speed ?? 1);
    this.ask({ speed: SPEEDS[Math.min(SPEEDS.length - 1, Math.max(0, now + by))] });
  }

  private step(by: number): void {
    if (this.playing) this.ask({ playing: false });
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
    if (kind === "note") return this.notes.map((note) => note.t);
    if (!lanes) return [];
    if (kind === "touch") return edges(lanes.touches);
    if (kind === "grasp") return edges(lanes.grasps);
    return lanes.events.filter((e) => (kind === "word" ? e.kind === "utterance" : e.kind === "command")).map((e) => e.t);
  }

  private shift(field: HTMLInputElement): void {
    if (!this.beside || !Number.isFinite(field.valueAsNumber)) return;
    this.beside.offset = field.valueAsNumber;
    this.send({ offset: this.beside.offset });
  }

  private markLoop(): void {
    if (this.head?.loop) this.ask({ loop: null });
    else if (this.loopFrom === null) this.loopFrom = this.t;
    else {
      this.ask({ loop: [Math.min(this.loopFrom, this.t), Math.max(this.loopFrom, this.t)] });
      this.loopFrom = null;
    }
    this.show();
  }

  private key(event: KeyboardEvent): void {
    const on = event.target as HTMLElement;
    if (!this.head || event.defaultPrevented || event.ctrlKey || event.metaKey || event.altKey || /^(INPUT|TEXTAREA|SELECT)$/.test(on.tagName)) return;
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
      n: () => this.jump("note", back),
      "+": () => this.zoom.zoom(NEARER, this.t),
      "=": () => this.zoom.zoom(NEARER, this.t),
      "-": () => this.zoom.zoom(1 / NEARER, this.t),
      "0": () => this.zoom.showAll(),
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
    this.goTo(this.zoom.at(box, event.clientX));
  }

  show(): void {
    const { head, lanes, zoom } = this;
    if (!head) return;
    render(
      <>
        <div class="moves">
          <button type="button" class="play" aria-label={text(head.playing ? "pause" : "play")} title={text(head.playing ? "pause" : "play")} onClick={() => this.toggle()}>
            {head.playing ? "❚❚" : "▶"}
          </button>
          <button type="button" title={text("back")} aria-label={text("back")} onClick={() => this.step(-FRAME_S)}>
            −1
          </button>
          <button type="button" title={text("on")} aria-label={text("on")} onClick={() => this.step(FRAME_S)}>
            +1
          </button>
          <output class="time">
            {clockText(this.t)} <small>{text("of", clockText(this.end_s))}</small>
          </output>
          <select aria-label={text("speed")} value={String(head.speed)} onChange={(e) => this.ask({ speed: Number(e.currentTarget.value) })}>
            {[...new Set([...SPEEDS, head.speed])].map((s) => (
              <option key={s} value={String(s)}>
                {s}×
              </option>
            ))}
          </select>
          <button type="button" title="o" aria-pressed={Boolean(head.loop) || this.loopFrom !== null} onClick={() => this.markLoop()}>
            {text(head.loop ? "loopEnd" : this.loopFrom === null ? "loop" : "loopTo")}
          </button>
          <span class="jumps">
            {KINDS.map((kind) => (
              <button type="button" key={kind} title={text("shiftBack", kind[0]!)} disabled={!this.times(kind).length} onClick={() => this.jump(kind)}>
                {text(`next_${kind}`)}
              </button>
            ))}
          </span>
          <span class="zoom">
            <button type="button" aria-label={text("farther")} title={text("farther")} disabled={!zoom.zoomed} onClick={() => zoom.zoom(1 / NEARER, this.t)}>
              −
            </button>
            <button type="button" aria-label={text("nearer")} title={text("nearer")} onClick={() => zoom.zoom(NEARER, this.t)}>
              +
            </button>
            <button type="button" aria-label={text("whole")} title={text("whole")} disabled={!zoom.zoomed} onClick={() => zoom.showAll()}>
              ↔
            </button>
          </span>
          <Export
            path={this.path}
            people={this.people}
            from={head.loop?.[0] ?? zoom.from}
            to={head.loop?.[1] ?? zoom.to}
            names={this.plotted()}
            offset={this.beside?.offset ?? 0}
          />
          {this.beside && (
            <label class="beside" title={text("offsetTitle")}>
              {text("beside", this.beside.name)}
              <span>
                {text("offset")}{" "}
                <input type="number" step="0.01" aria-label={text("offsetTitle")} value={this.beside.offset} onChange={(e) => this.shift(e.currentTarget)} /> s
              </span>
            </label>
          )}
          {this.toLive && (
            <button type="button" class="live" onClick={this.toLive}>
              {text("toLive")}
            </button>
          )}
        </div>
        <div class="lanes">
          <Names lanes={lanes} notes={this.notes} />
          <div
            class="tracks"
            role="slider"
            tabIndex={0}
            aria-label={text("moment")}
            aria-valuemin={0}
            aria-valuemax={this.end_s}
            aria-valuenow={this.t}
            aria-valuetext={clockText(this.t)}
            onWheel={(e) => wheeled(zoom, e, e.currentTarget)}
            onDragStart={(e) => e.preventDefault() /* of text that is selected; it would end the dragging of the playhead */}
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
              if (by) this.goTo(this.t + by * Math.min(1, zoom.length / 20));
            }}
          >
            {head.loop && <i class="loop" style={{ left: zoom.percent(head.loop[0]), width: zoom.width(head.loop[1] - head.loop[0]) }} />}
            {lanes && <Tracks lanes={lanes} notes={this.notes} zoom={zoom} from={zoom.from} to={zoom.to} ticks={Math.max(2, Math.floor(this.parent.clientWidth / TICK_PX))} />}
            <i class="head" style={{ left: zoom.percent(this.t) }} />
          </div>
          {zoom.zoomed && (
            <input
              type="range"
              class="seen"
              aria-label={text("seen")}
              aria-valuetext={`${clockText(zoom.from)} – ${clockText(zoom.to)}`}
              min={0}
              max={Math.max(0, this.end_s - zoom.length)}
              step="any"
              value={zoom.from}
              onInput={(e) => zoom.show(Number(e.currentTarget.value), Number(e.currentTarget.value) + zoom.length)}
            />
          )}
        </div>
        <p class="said" aria-live="polite">
          {this.saying(lanes, head)}
        </p>
      </>,
      this.parent,
    );
  }

  private saying(lanes: Lanes | null, head: Playhead): string {
    const just = ({ t }: { t: number }) => t <= this.t + 1e-3 && t > this.t - 3;
    const now = lanes?.events.findLast(just);
    const note = this.notes.findLast(just);
    const parts: string[] = now ? [`${now.who}: ${now.text}`] : [];
    if (note) parts.push(`${note.author || text("note")}: ${note.text}`);
    if (this.sound && head.speed !== 1) parts.push(text("silentSpeed", head.speed));
    else if (this.sound && !head.playing) parts.push(text("silentStill"));
    if (!lanes || lanes.done < 1) parts.push(text("lanes", Math.round(100 * (lanes?.done ?? 0))));
    if (lanes?.left_out) parts.push(text("leftOut", lanes.left_out));
    if (this.grows && this.toLive) parts.push(text("recorded"));
    else parts.push(...(lanes?.damage.length ? lanes.damage : this.damage));
    if (head.t >= head.end && !this.toLive) parts.push(text("end"));
    return parts.join(" · ");
  }
}

function Names({ lanes, notes }: { lanes: Lanes | null; notes: Note[] }) {
  return (
    <div class="names" aria-hidden="true">
      <span class="ruler" />
      {(lanes ? rows(lanes, notes) : [[text("reading"), null]] as const).map(([name]) => (
        <span key={name}>{name}</span>
      ))}
    </div>
  );
}

/** from, to: of the zoom; ticks: of the ruler, at most; nothing is laid out anew until they or the lanes change. */
function Tracks({ lanes, notes, zoom, from, to, ticks }: { lanes: Lanes; notes: Note[]; zoom: Zoom; from: number; to: number; ticks: number }) {
  return useMemo(() => {
    const at = (t: number) => zoom.percent(t);
    const span = (a: number, b: number) => ({ left: at(a), width: zoom.width(b - a) });
    const seen = ([a, b]: readonly [number, number, ...unknown[]]) => b >= from && a <= to;
    return (
      <>
        <div class="ruler" aria-hidden="true">
          {ruled(from, to, ticks).map(([t, said]) => (
            <span key={t} style={{ left: at(t) }}>
              {said}
            </span>
          ))}
        </div>
        {rows(lanes, notes).map(([name, row]) => (
          <div class="track" key={name}>
            {row.energy && (
              <svg viewBox={`0 0 ${row.energy.length} 1`} preserveAspectRatio="none" aria-hidden="true" style={span(0, lanes.end)}>
                <path d={filled(row.energy)} />
              </svg>
            )}
            {row.talks?.filter(seen).map(([a, b]) => <i key={a} class="talks" style={span(a, b)} />)}
            {row.spans?.filter(seen).map(([a, b, what], n) => <i key={n} class={row.kind} title={what} style={span(a, b)} />)}
            {row.points?.filter((p) => seen([p.t, p.t])).map((p, n) => <b key={n} class={row.kind} title={`${p.who} ${p.text}`} style={{ left: at(p.t) }} />)}
          </div>
        ))}
      </>
    );
  }, [lanes, notes, from, to, ticks]);
}

interface Row {
  energy?: number[];
  talks?: [number, number][];
  spans?: Span[];
  points?: Pick<Event, "t" | "who" | "text">[];
  kind?: string;
}

function rows(lanes: Lanes, notes: Note[]): (readonly [string, Row])[] {
  const talks = (who: string) => {
    const of = lanes.voices.find((v) => v.name === who)?.talks ?? [];
    const bin = lanes.end / of.length;
    return of.flatMap((on, n): [number, number][] => (on && !of[n - 1] ? [[n * bin, (of.indexOf(0, n) < 0 ? of.length : of.indexOf(0, n)) * bin]] : []));
  };
  const out: (readonly [string, Row])[] = lanes.people.map((p) => [p.name, { energy: p.energy, talks: talks(p.name) }]);
  out.push([text("touches"), { spans: lanes.touches, kind: "touch" }], [text("grasps"), { spans: lanes.grasps, kind: "grasp" }]);
  out.push([text("words"), { points: lanes.events, kind: "event" }]);
  if (notes.length) out.push([text("notes"), { points: notes.map(({ t, author, text }) => ({ t, who: author, text })), kind: "noted" }]);
  if (lanes.gaps.length || lanes.faults.length)
    out.push([text("gaps"), { spans: lanes.gaps, points: lanes.faults.map(([t, text]) => ({ t, who: "", text })), kind: "gap" }]);
  return out;
}
