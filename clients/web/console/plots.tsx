// Numbers of a log as curves under the timeline: one picture for each unit, all with the timeline's playhead and zoom.
import { render } from "preact";
import uPlot from "uplot";
import style from "uplot/dist/uPlot.min.css";
import { Chooser } from "./chooser";
import type { Asked } from "./timeline";
import { text } from "./words";
import type { Curve, Fields, Plot } from "./wire";
import type { Zoom } from "./zoom";

const SOON_MS = 120; // from a change of what is seen to the question for it
const HIGH_PX = 104; // a picture
const AXIS_PX = 22; // the time below the last picture
export const MOST = 12; // vistel/log/questions.py
const AROUND = 0.05; // share of what is seen that is asked for before and after it, so that curves go to the edges
const COLOURS = 8; // of console.css, after which lines are broken
const GROWN_S = 5; // by so much a log has grown before it is asked again
export const BESIDE = "beside.";
export const DIFFERENCE = "difference.";

/** What is asked of the log by name. */
export interface PlotAsked {
  id: number;
  names: string[];
  from: number;
  to: number;
  wide: number;
}

export class Plots {
  private names: string[] = [];
  private fields: Fields | null = null;
  private plot: Plot | null = null;
  private readonly panels = new Map<string, uPlot>();
  private id = 0;
  private later = 0;
  private beside = false;
  private askedTo = 0;
  private t = 0;

  /** send: to the server; moved: the hand holds the playhead at a moment; changed: other numbers are plotted. */
  constructor(
    private readonly parent: HTMLElement,
    private readonly zoom: Zoom,
    private readonly send: (asked: Asked) => void,
    private readonly moved: (t: number) => void,
    private readonly changed: () => void,
  ) {
    const sheet = new CSSStyleSheet();
    sheet.replaceSync(style);
    document.adoptedStyleSheets.push(sheet);
    new ResizeObserver(() => this.resize()).observe(parent);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.draw(true));
  }

  get chosen(): readonly string[] {
    return this.names;
  }

  /** Of programs that look: the curves as they came. */
  get curves(): readonly Curve[] {
    return this.plot?.curves ?? [];
  }

  begin(names: string[], beside: boolean): void {
    this.beside = beside;
    this.fields = null;
    this.plot = null;
    this.show(names);
  }

  choose(names: string[]): void {
    this.show(names);
    this.changed();
  }

  private show(names: string[]): void {
    this.names = [...new Set(names)].slice(0, MOST);
    this.ask();
    this.draw(true);
  }

  receive(words: Plot | Fields): void {
    if (words.kind === "fields") this.fields = words;
    else if (words.id === this.id) this.plot = words;
    this.draw();
  }

  /** Another part is seen. */
  zoomed(): void {
    this.ask();
    this.draw();
  }

  /** Where the playhead is, in a log of so many seconds. */
  move(t: number, end: number): void {
    this.t = t;
    if (end > this.askedTo + GROWN_S && this.zoom.to > this.askedTo) this.ask();
    for (const panel of this.panels.values()) this.placeHead(panel);
    if (this.names.length) this.drawLegend();
  }

  private ask(): void {
    this.askedTo = this.zoom.to;
    clearTimeout(this.later);
    if (!this.names.length) return void (this.plot = null);
    this.later = window.setTimeout(() => {
      const pixels = (this.parent.clientWidth - this.gutter) * Math.min(2, devicePixelRatio);
      const wide = Math.max(50, Math.round((1 + 2 * AROUND) * pixels));
      const { from, to, length } = this.zoom;
      const plot: PlotAsked = { id: ++this.id, names: this.names, from: Math.max(0, from - AROUND * length), to: to + AROUND * length, wide };
      this.send({ plot });
    }, SOON_MS);
  }

  /** Names of lanes are as wide [px]. */
  private get gutter(): number {
    return parseFloat(getComputedStyle(this.parent).getPropertyValue("--gutter")) * parseFloat(getComputedStyle(document.documentElement).fontSize);
  }

  private get units(): Map<string, Curve[]> {
    const units = new Map<string, Curve[]>();
    for (const curve of this.plot?.curves ?? []) {
      if (!this.names.includes(curve.name)) continue;
      const unit = (curve.name.startsWith(DIFFERENCE) ? "Δ " : "") + curve.unit; // what differs little needs a scale of its own
      units.set(unit, [...(units.get(unit) ?? []), curve]);
    }
    return units;
  }

  private draw(anew = false): void {
    const units = this.units;
    for (const [unit, panel] of this.panels) {
      if (!anew && units.has(unit)) continue;
      panel.destroy();
      this.panels.delete(unit);
    }
    this.drawLegend();
    const last = [...units.keys()].at(-1);
    for (const [unit, curves] of units) {
      const data = joined(curves);
      const panel = this.panels.get(unit);
      const same = panel && panel.series.length === curves.length + 1 && panel.axes[0]!.show === (unit === last);
      if (same) panel.setData(data, false);
      else {
        panel?.destroy();
        this.panels.set(unit, this.made(unit, curves, data, unit === last));
      }
      const shown = this.panels.get(unit)!;
      shown.setScale("x", { min: this.zoom.from, max: this.zoom.to });
      this.placeHead(shown);
    }
  }

  private made(unit: string, curves: Curve[], data: uPlot.AlignedData, last: boolean): uPlot {
    const place = this.parent.querySelector<HTMLElement>(`[data-unit="${CSS.escape(unit)}"]`)!;
    const colour = (name: string) => {
      place.style.color = `var(${name})`;
      return getComputedStyle(place).color;
    };
    const line = { stroke: colour("--line"), width: 1 };
    const axis = { stroke: colour("--faint"), grid: line, ticks: { ...line, size: 4 }, font: `11px ${getComputedStyle(document.body).fontFamily}` };
    const panel = new uPlot(
      {
        width: place.clientWidth,
        height: HIGH_PX + (last ? AXIS_PX : 0),
        padding: [8, 0, last ? 0 : 6, 0],
        legend: { show: false },
        cursor: { drag: { x: false, y: false }, y: false, points: { show: false }, sync: { key: "plots" } },
        scales: { x: { time: false, auto: false }, y: { range: spread } },
        axes: [
          { ...axis, show: last, size: AXIS_PX, values: (_, marks) => marks.map((t) => `${+t.toFixed(3)} s`) },
          { ...axis, size: this.gutter, gap: 4 },
        ],
        series: [
          {},
          ...curves.map((curve): uPlot.Series => {
            const n = this.names.indexOf(curve.name);
            return { stroke: colour(`--curve-${n % COLOURS}`), width: 1.5, points: { show: false }, ...(n >= COLOURS ? { dash: [5, 3] } : {}) };
          }),
        ],
      },
      data,
      place,
    );
    const head = document.createElement("i");
    head.className = "head";
    panel.over.append(head);
    panel.over.addEventListener("pointerdown", (event) => {
      panel.over.setPointerCapture(event.pointerId);
      this.moved(this.zoom.at(panel.over.getBoundingClientRect(), event.clientX));
    });
    panel.over.addEventListener("pointermove", (event) => {
      if (panel.over.hasPointerCapture(event.pointerId)) this.moved(this.zoom.at(panel.over.getBoundingClientRect(), event.clientX));
    });
    panel.over.addEventListener("wheel", (event) => wheeled(this.zoom, event, panel.over), { passive: false });
    return panel;
  }

  private placeHead(panel: uPlot): void {
    const head = panel.over.querySelector<HTMLElement>("i.head")!;
    head.style.left = this.zoom.percent(this.t);
  }

  private resize(): void {
    for (const panel of this.panels.values()) panel.setSize({ width: this.parent.clientWidth, height: panel.height });
    this.ask();
  }

  private drawLegend(): void {
    const { names, plot } = this;
    const told = new Map(plot?.curves?.map((curve) => [curve.name, curve]));
    const reading = names.length && plot && plot.done < 1 ? text("readingPlots", Math.round(100 * plot.done)) : "";
    render(
      <>
        <div class="choose">
          <Chooser
            fields={this.fields}
            beside={this.beside}
            full={names.length >= MOST}
            open={() => this.fields ?? this.send({ fields: true })}
            choose={(name) => this.choose([...this.names, name])}
          />
          <ul class="legend" aria-label={text("plots")}>
            {names.map((name, n) => {
              const curve = told.get(name);
              const value = curve && valueAt(curve, this.t);
              return (
                <li key={name}>
                  <svg width="18" height="6" aria-hidden="true">
                    <path d="M0 3H18" style={{ stroke: `var(--curve-${n % COLOURS})`, strokeDasharray: n >= COLOURS ? "5 3" : "none" }} />
                  </svg>
                  <span>{name}</span>
                  <output>{value === undefined ? "–" : `${spelled(value)} ${curve!.unit}`}</output>
                  <button type="button" aria-label={text("remove", name)} title={text("remove", name)}
                    onClick={() => this.choose(this.names.filter((other) => other !== name))}>
                    ×
                  </button>
                </li>
              );
            })}
          </ul>
          <span class="reading" role="status">{plot?.fault && names.length ? plot.fault : reading}</span>
        </div>
        {[...this.units.keys()].map((unit) => (
          <div class="plot" key={unit} data-unit={unit} role="img" aria-label={`${text("plots")} ${unit}`} />
        ))}
      </>,
      this.parent,
    );
  }
}

/** The wheel over lanes and plots: nearer and farther; with Shift earlier and later. */
export function wheeled(zoom: Zoom, event: WheelEvent, over: HTMLElement): void {
  event.preventDefault();
  const by = event.deltaY || event.deltaX;
  if (event.shiftKey || Math.abs(event.deltaX) > Math.abs(event.deltaY)) zoom.shift(0.1 * Math.sign(event.deltaX || by));
  else zoom.zoom(1.2 ** Math.sign(by), zoom.at(over.getBoundingClientRect(), event.clientX));
}

/** Curves over the times of all of them. */
function joined(curves: Curve[]): uPlot.AlignedData {
  if (!curves.some((curve) => curve.t.length)) return [[0], ...curves.map(() => [null])] as uPlot.AlignedData;
  return uPlot.join(curves.map(({ t, v }): uPlot.AlignedData => [t, v]));
}

/** Some room over and under the values, also where there is only one. */
function spread(_: uPlot, least: number | null, most: number | null): uPlot.Range.MinMax {
  if (least === null || most === null || !Number.isFinite(least)) return [0, 1];
  const room = most > least ? 0.08 * (most - least) : Math.max(1e-6, 0.05 * Math.abs(most)) || 1;
  return [least - room, most + room];
}

/** What it was at a moment: the newest value; none after a gap or before the first. */
function valueAt({ t, v }: Curve, at: number): number | undefined {
  let [low, high] = [0, t.length];
  while (low < high) {
    const middle = (low + high) >> 1;
    if (t[middle]! <= at) low = middle + 1;
    else high = middle;
  }
  return v[low - 1] ?? undefined;
}

function spelled(value: number): string {
  const size = Math.abs(value);
  return size !== 0 && (size < 1e-3 || size >= 1e6) ? value.toExponential(2) : String(+value.toFixed(size < 10 ? 3 : size < 1000 ? 2 : 1));
}
