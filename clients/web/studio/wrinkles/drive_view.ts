// How much of a set of wrinkles is there over what drives it: a curve through knots that are dragged.

import { FONT, INK } from "./colours";
import { fitted, nextFrame } from "./dom";
import { adjustSet } from "./edits";
import { clamp, mix } from "./geometry";
import type { State } from "./state";
import type { Vec } from "./types";

const EDGE = { left: 42, right: 18, top: 14, bottom: 26 };

export class DriveView {
  private knot = -1;
  private dragging = false;
  private count = 0;
  readonly redraw = nextFrame(() => this.paint());

  constructor(
    private readonly canvas: HTMLCanvasElement,
    private readonly state: State,
  ) {
    state.listen((change) => {
      if (change === "selection") this.knot = Math.min(this.knot, (state.set?.drive.curve.knots.length ?? 0) - 1);
      this.redraw();
    });
    canvas.addEventListener("pointerdown", (e) => this.down(e));
    canvas.addEventListener("pointermove", (e) => this.move(e));
    canvas.addEventListener("pointerup", () => this.up());
    canvas.addEventListener("pointercancel", () => this.up());
    canvas.addEventListener("dblclick", (e) => this.twice(e));
    canvas.addEventListener("keydown", (e) => this.key(e));
    new ResizeObserver(() => this.redraw()).observe(canvas);
  }

  private get span(): Vec {
    const drive = this.state.set?.drive;
    if (!drive) return [0, 1];
    const values = drive.curve.knots.map((k) => k[0]);
    if (drive.action) return [Math.min(0, ...values), Math.max(1, ...values)];
    const low = drive.axis ? -90 : 0;
    return [Math.min(low, ...values), Math.max(drive.axis ? 120 : 150, ...values)];
  }

  /** Where a value and a weight are on the canvas, in CSS pixels. */
  toScreen([x, y]: Vec): Vec {
    const [low, high] = this.span;
    const { clientWidth: w, clientHeight: h } = this.canvas;
    return [
      mix(EDGE.left, w - EDGE.right, (x - low) / (high - low)),
      mix(h - EDGE.bottom, EDGE.top, y),
    ];
  }

  private toCurve([x, y]: Vec): Vec {
    const [low, high] = this.span;
    const { clientWidth: w, clientHeight: h } = this.canvas;
    const step = this.state.set?.drive.action ? 100 : 2;
    const value = mix(low, high, (x - EDGE.left) / (w - EDGE.right - EDGE.left));
    const weight = (h - EDGE.bottom - y) / (h - EDGE.bottom - EDGE.top);
    return [Math.round(clamp(value, low, high) * step) / step, Math.round(clamp(weight, 0, 1) * 100) / 100];
  }

  private at(e: MouseEvent): Vec {
    const box = this.canvas.getBoundingClientRect();
    return [e.clientX - box.left, e.clientY - box.top];
  }

  private down(e: PointerEvent): void {
    this.canvas.focus();
    const s = this.at(e);
    const knots = this.state.set?.drive.curve.knots ?? [];
    this.knot = knots.findIndex((k) => Math.hypot(this.toScreen(k)[0] - s[0], this.toScreen(k)[1] - s[1]) < 11);
    this.dragging = this.knot >= 0;
    this.count++;
    this.canvas.setPointerCapture(e.pointerId);
    this.redraw();
  }

  private move(e: PointerEvent): void {
    if (!this.dragging) return;
    const to = this.toCurve(this.at(e));
    adjustSet(this.state, "Driving curve", (set) => {
      const { knots } = set.drive.curve;
      const least = set.drive.action ? 0.01 : 0.5;
      const before = knots[this.knot - 1];
      const after = knots[this.knot + 1];
      const low = before ? before[0] + least : -Infinity;
      const high = after ? after[0] - least : Infinity;
      knots[this.knot] = [clamp(to[0], low, high), to[1]];
    }, `knot ${this.count}`); // prettier-ignore
  }

  private up(): void {
    if (this.dragging) this.state.history.seal();
    this.dragging = false;
  }

  private twice(e: MouseEvent): void {
    const to = this.toCurve(this.at(e));
    const knots = this.state.set?.drive.curve.knots;
    if (!knots || this.knot >= 0 || knots.some((k) => Math.abs(k[0] - to[0]) < 1e-6)) return;
    this.knot = knots.findIndex((k) => k[0] > to[0]);
    if (this.knot < 0) this.knot = knots.length;
    adjustSet(this.state, "Add knot", (set) => set.drive.curve.knots.splice(this.knot, 0, to));
  }

  private key(e: KeyboardEvent): void {
    if (e.key !== "Delete" && e.key !== "Backspace") return;
    e.stopPropagation();
    e.preventDefault();
    const knots = this.state.set?.drive.curve.knots;
    if (!knots || knots.length <= 2 || this.knot < 0) return;
    const gone = this.knot;
    this.knot = -1;
    adjustSet(this.state, "Delete knot", (set) => set.drive.curve.knots.splice(gone, 1));
  }

  private paint(): void {
    const ratio = fitted(this.canvas);
    const ink = this.canvas.getContext("2d");
    const set = this.state.set;
    if (!ink) return;
    ink.setTransform(ratio, 0, 0, ratio, 0, 0);
    const { clientWidth: w, clientHeight: h } = this.canvas;
    ink.clearRect(0, 0, w, h);
    if (!set) return;
    const { knots, form } = set.drive.curve;
    const [low, high] = this.span;
    ink.font = FONT;
    ink.lineWidth = 1;
    this.paintGrid(ink, low, high, set.drive.action !== null);
    const line: Vec[] = [[low, knots[0]?.[1] ?? 0]];
    for (let k = 0; k + 1 < knots.length; k++) {
      const [x0, y0] = knots[k] as Vec;
      const [x1, y1] = knots[k + 1] as Vec;
      for (let i = 0; i <= 16; i++) {
        const t = i / 16;
        line.push([mix(x0, x1, t), mix(y0, y1, form === "smooth" ? t * t * (3 - 2 * t) : t)]);
      }
    }
    line.push([high, knots.at(-1)?.[1] ?? 0]);
    ink.beginPath();
    line.forEach((p, k) => {
      const [x, y] = this.toScreen(p);
      if (k === 0) ink.moveTo(x, y);
      else ink.lineTo(x, y);
    });
    ink.strokeStyle = INK.ridge;
    ink.lineWidth = 2;
    ink.stroke();
    ink.lineTo(w - EDGE.right, h - EDGE.bottom);
    ink.lineTo(EDGE.left, h - EDGE.bottom);
    ink.fillStyle = "rgba(255,180,84,0.08)";
    ink.fill();
    knots.forEach((k, n) => {
      const [x, y] = this.toScreen(k);
      ink.beginPath();
      ink.arc(x, y, 5, 0, 2 * Math.PI);
      ink.fillStyle = n === this.knot ? INK.bright : INK.ridge;
      ink.fill();
      ink.strokeStyle = "#1c1e21";
      ink.lineWidth = 2;
      ink.stroke();
      if (n === this.knot) {
        ink.fillStyle = INK.bright;
        ink.textAlign = x > w - 90 ? "right" : "left";
        ink.textBaseline = "middle";
        const unit = set.drive.action ? "" : "°";
        ink.fillText(`${k[0]}${unit}, ${Math.round(100 * k[1])} %`, x + (x > w - 90 ? -11 : 11), y < 26 ? y + 12 : y - 9);
      }
    });
    this.paintNow(ink, h);
  }

  private paintGrid(ink: CanvasRenderingContext2D, low: number, high: number, action: boolean): void {
    const step = action ? 0.25 : 30;
    ink.strokeStyle = INK.grid;
    ink.fillStyle = INK.text;
    ink.textAlign = "center";
    ink.textBaseline = "top";
    for (let x = Math.ceil(low / step) * step; x <= high + 1e-9; x += step) {
      const [sx, bottom] = this.toScreen([x, 0]);
      const top = this.toScreen([x, 1])[1];
      ink.beginPath();
      ink.moveTo(Math.round(sx) + 0.5, top);
      ink.lineTo(Math.round(sx) + 0.5, bottom);
      ink.stroke();
      ink.fillText(action ? x.toFixed(2) : `${Math.round(x)}°`, sx, bottom + 7);
    }
    ink.textAlign = "right";
    ink.textBaseline = "middle";
    for (const y of [0, 0.5, 1]) {
      const [left, sy] = this.toScreen([low, y]);
      ink.beginPath();
      ink.moveTo(left, Math.round(sy) + 0.5);
      ink.lineTo(this.toScreen([high, y])[0], Math.round(sy) + 0.5);
      ink.stroke();
      ink.fillText(`${100 * y} %`, left - 8, sy);
    }
  }

  /** Where the figure is now. */
  private paintNow(ink: CanvasRenderingContext2D, h: number): void {
    const now = this.state.now;
    const [low, high] = this.span;
    if (!now || now.driven < low - 1 || now.driven > high + 1) return;
    const x = this.toScreen([clamp(now.driven, low, high), 0])[0];
    ink.strokeStyle = INK.pin;
    ink.lineWidth = 1.25;
    ink.beginPath();
    ink.moveTo(x, EDGE.top - 6);
    ink.lineTo(x, h - EDGE.bottom);
    ink.stroke();
    ink.fillStyle = INK.pin;
    ink.beginPath();
    ink.moveTo(x - 4, EDGE.top - 8);
    ink.lineTo(x + 4, EDGE.top - 8);
    ink.lineTo(x, EDGE.top - 2);
    ink.fill();
  }
}
