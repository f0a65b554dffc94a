// The texture of a region, unrolled, with its wrinkles as curves that are drawn and dragged.

import { INK } from "./colours";
import { fitted, nextFrame } from "./dom";
import * as edits from "./edits";
import { clamp, distance, nearest, sampled, sub, type OnCurve } from "./geometry";
import { AROUND, paintPlane, paintPoint, paintWidth, path } from "./ink";
import type { State } from "./state";
import type { Vec } from "./types";

const GRAB = 9;

interface Hit {
  wrinkle: number;
  branch: number;
  point: number;
  place: OnCurve | null;
  width: boolean;
}

type Drag =
  | { kind: "point"; branch: number; point: number; name: string }
  | { kind: "width"; branch: number; point: number; name: string }
  | { kind: "wrinkle"; last: Vec; name: string }
  | { kind: "pan"; last: Vec };

export class PlaneView {
  private zoom = 0;
  private middle: Vec = [0.15, 0.25];
  private shown = "";
  private picture: HTMLCanvasElement | null = null;
  private drag: Drag | null = null;
  private drawn: Vec[] = [];
  private hover: Vec | null = null;
  private hovered: Hit | null = null;
  private count = 0;
  readonly redraw = nextFrame(() => this.paint());

  constructor(
    private readonly canvas: HTMLCanvasElement,
    private readonly state: State,
    private readonly say: (text: string) => void,
  ) {
    state.listen((change) => {
      if (change === "selection") {
        const key = `${state.selection.set} ${state.selection.side}`;
        if (key !== this.shown) {
          this.shown = key;
          this.picture = null;
          this.frame();
        }
      }
      this.redraw();
    });
    canvas.addEventListener("pointerdown", (e) => this.down(e));
    canvas.addEventListener("pointermove", (e) => this.move(e));
    canvas.addEventListener("pointerup", (e) => this.up(e));
    canvas.addEventListener("pointercancel", (e) => this.up(e));
    canvas.addEventListener("pointerleave", () => {
      this.hover = null;
      this.redraw();
    });
    canvas.addEventListener("dblclick", (e) => this.twice(e));
    canvas.addEventListener("contextmenu", (e) => e.preventDefault());
    canvas.addEventListener("wheel", (e) => this.wheel(e), { passive: false });
    new ResizeObserver(() => {
      if (this.zoom === 0) this.frame();
      this.redraw();
    }).observe(canvas);
  }

  /** The plane's colour under the light of its set, (h, w, 4). */
  show(pixels: Uint8Array, width: number, height: number): void {
    const picture = document.createElement("canvas");
    picture.width = width;
    picture.height = height;
    const data = new ImageData(new Uint8ClampedArray(pixels), width, height);
    picture.getContext("2d")?.putImageData(data, 0, 0);
    this.picture = picture;
    this.redraw();
  }

  /** Shows the whole plane. */
  frame(): void {
    const [w, h] = this.state.plane;
    const { clientWidth, clientHeight } = this.canvas;
    this.zoom = Math.min(clientWidth / (w * 1.35), clientHeight / (h * 1.12));
    this.middle = [w / 2, h / 2];
    this.redraw();
  }

  /** Ends what is being drawn; false: forgets it. */
  finish(keep: boolean): boolean {
    const places = this.drawn;
    this.drawn = [];
    if (places.length === 0) return false;
    if (keep && places.length >= 2) {
      if (this.state.tool === "branch") edits.drawBranch(this.state, places);
      else edits.drawCurve(this.state, places);
    }
    this.state.tool = "select";
    this.state.tell("look");
    return true;
  }

  /** Where a place of the plane is on the screen, in CSS pixels of the canvas. */
  toScreen(p: Vec): Vec {
    const { clientWidth, clientHeight } = this.canvas;
    return [clientWidth / 2 + (p[0] - this.middle[0]) * this.zoom, clientHeight / 2 - (p[1] - this.middle[1]) * this.zoom];
  }

  private readonly there = (p: Vec): Vec => this.toScreen(p);

  private toPlane(s: Vec): Vec {
    const { clientWidth, clientHeight } = this.canvas;
    return [this.middle[0] + (s[0] - clientWidth / 2) / this.zoom, this.middle[1] - (s[1] - clientHeight / 2) / this.zoom];
  }

  private at(e: MouseEvent): Vec {
    const box = this.canvas.getBoundingClientRect();
    return [e.clientX - box.left, e.clientY - box.top];
  }

  private hit(s: Vec): Hit | null {
    const { state } = this;
    const p = this.toPlane(s);
    const reach = GRAB / this.zoom;
    const chosen = state.selection.wrinkle;
    const order = (state.set?.wrinkles ?? []).map((_, n) => n).sort((a, b) => +(b === chosen) - +(a === chosen));
    const handle = this.widthHandle();
    if (handle && distance(handle, p) < reach) {
      const { wrinkle, branch, point } = state.selection;
      return { wrinkle, branch, point, place: null, width: true };
    }
    for (const n of order) {
      let best: Hit | null = null;
      let least = reach;
      state.pointsOf(n).forEach((points, branch) =>
        points.forEach((at, point) => {
          const away = distance(at, p);
          if (away < least) {
            least = away;
            best = { wrinkle: n, branch, point, place: null, width: false };
          }
        }),
      );
      if (best) return best;
    }
    for (const n of order) {
      let best: Hit | null = null;
      let least = reach;
      state.curvesOf(n).forEach((curve, branch) => {
        const found = nearest(curve, p);
        if (found && found.away < least) {
          least = found.away;
          best = { wrinkle: n, branch, point: -1, place: found.place, width: false };
        }
      });
      if (best) return best;
    }
    return null;
  }

  /** Where the radius at the selected point is dragged. */
  private widthHandle(): Vec | null {
    const { selection, shape, wrinkle } = this.state;
    const points = this.state.pointsOf(selection.wrinkle)[selection.branch];
    const at = points?.[selection.point];
    const point = shape?.branches[selection.branch]?.points[selection.point];
    if (!points || !at || !point || !wrinkle) return null;
    const before = points[Math.max(0, selection.point - 1)] as Vec;
    const after = points[Math.min(points.length - 1, selection.point + 1)] as Vec;
    const along = sub(after, before);
    const length = Math.hypot(...along) || 1;
    const radius = Math.max(wrinkle.thickness * point.thickness, 12 / this.zoom);
    return [at[0] - (along[1] / length) * radius, at[1] + (along[0] / length) * radius];
  }

  private down(e: PointerEvent): void {
    const s = this.at(e);
    this.canvas.focus();
    this.canvas.setPointerCapture(e.pointerId);
    if (e.button !== 0) {
      this.drag = { kind: "pan", last: s };
      return;
    }
    if (this.state.tool !== "select") {
      this.place(s);
      return;
    }
    const hit = this.hit(s);
    const name = `drag ${++this.count}`;
    if (!hit) {
      this.state.select({ wrinkle: -1 });
      this.drag = { kind: "pan", last: s };
    } else if (hit.width) {
      this.drag = { kind: "width", branch: hit.branch, point: hit.point, name };
    } else {
      this.state.select({ wrinkle: hit.wrinkle, branch: hit.branch, point: hit.point });
      this.drag = hit.point >= 0
        ? { kind: "point", branch: hit.branch, point: hit.point, name }
        : { kind: "wrinkle", last: this.toPlane(s), name }; // prettier-ignore
    }
  }

  /** A click with a drawing tool. */
  private place(s: Vec): void {
    const { state } = this;
    let p = this.toPlane(s);
    if (state.tool === "branch" && this.drawn.length === 0) {
      const hit = this.hit(s);
      if (!hit) {
        this.say("A branch begins on a curve: click on one");
        return;
      }
      const points = state.pointsOf(hit.wrinkle)[hit.branch];
      p = hit.place?.at ?? points?.[hit.point] ?? p;
      state.select({ wrinkle: hit.wrinkle, branch: hit.branch });
    } else if (state.tool === "branch") {
      p = edits.snapped(state.pointsOf(state.selection.wrinkle), -1, p, GRAB / this.zoom);
    }
    const last = this.drawn.at(-1);
    if (last && distance(last, p) < 2 / this.zoom) return;
    this.drawn.push(this.inside(p));
    this.redraw();
  }

  private inside(p: Vec): Vec {
    const [w, h] = this.state.plane;
    return [clamp(p[0], -AROUND * w, (1 + AROUND) * w), clamp(p[1], 0, h)];
  }

  private move(e: PointerEvent): void {
    const s = this.at(e);
    const p = this.toPlane(s);
    this.hover = p;
    const { drag, state } = this;
    if (!drag) {
      this.hovered = state.tool === "draw" ? null : this.hit(s);
      this.canvas.style.cursor = state.tool !== "select" ? "crosshair" : this.hovered ? "pointer" : "grab";
      this.redraw();
    } else if (drag.kind === "pan") {
      this.middle = [this.middle[0] - (s[0] - drag.last[0]) / this.zoom, this.middle[1] + (s[1] - drag.last[1]) / this.zoom];
      drag.last = s;
      this.redraw();
    } else if (drag.kind === "wrinkle") {
      edits.shift(state, sub(p, drag.last), drag.name);
      drag.last = p;
    } else if (drag.kind === "point") {
      edits.reshape(state, "Move point", (points) => {
        const of = points[drag.branch];
        if (!of) return;
        const from = of[drag.point] as Vec;
        const end = drag.point === 0 || drag.point === of.length - 1;
        const to = end && !e.altKey ? edits.snapped(points, drag.branch, p, GRAB / this.zoom) : p;
        const there = this.inside(to);
        // Ends of other branches that lie on this point go along.
        points.forEach((other, b) =>
          other.forEach((q, k) => {
            const atEnd = k === 0 || k === other.length - 1;
            if (b !== drag.branch && atEnd && distance(q, from) < 1e-6) other[k] = there;
          }),
        );
        of[drag.point] = there;
      }, drag.name); // prettier-ignore
    } else {
      const at = state.pointsOf(state.selection.wrinkle)[drag.branch]?.[drag.point];
      if (!at) return;
      const radius = distance(at, p);
      edits.reshape(state, "Width", (_, shape, w) => {
        const point = shape.branches[drag.branch]?.points[drag.point];
        if (point) point.thickness = Math.round(clamp(radius / w.thickness, 0.05, 1) * 1000) / 1000;
      }, drag.name); // prettier-ignore
    }
  }

  private up(e: PointerEvent): void {
    if (this.canvas.hasPointerCapture(e.pointerId)) this.canvas.releasePointerCapture(e.pointerId);
    if (this.drag) this.state.history.seal();
    this.drag = null;
  }

  private twice(e: MouseEvent): void {
    if (this.state.tool !== "select") {
      this.finish(true);
      return;
    }
    const hit = this.hit(this.at(e));
    if (hit?.place) {
      this.state.select({ wrinkle: hit.wrinkle });
      edits.insertPoint(this.state, hit.branch, hit.place);
    }
  }

  private wheel(e: WheelEvent): void {
    e.preventDefault();
    const s = this.at(e);
    const before = this.toPlane(s);
    this.zoom = clamp(this.zoom * Math.exp(-e.deltaY * 0.0015), 60, 40000);
    const after = this.toPlane(s);
    this.middle = [this.middle[0] + before[0] - after[0], this.middle[1] + before[1] - after[1]];
    this.redraw();
  }

  private paint(): void {
    const ratio = fitted(this.canvas);
    const ink = this.canvas.getContext("2d");
    if (!ink) return;
    ink.setTransform(ratio, 0, 0, ratio, 0, 0);
    const { clientWidth, clientHeight } = this.canvas;
    ink.fillStyle = INK.back;
    ink.fillRect(0, 0, clientWidth, clientHeight);
    if (!this.state.set) return;
    const knots = this.state.regionOf(this.state.set)?.knots ?? [];
    paintPlane(ink, this.there, this.state.plane, this.picture, knots);
    (this.state.set.wrinkles ?? []).forEach((_, n) => {
      if (n !== this.state.selection.wrinkle) this.paintWrinkle(ink, n, false);
    });
    if (this.state.wrinkle) this.paintWrinkle(ink, this.state.selection.wrinkle, true);
    this.paintDrawing(ink);
  }

  private paintWrinkle(ink: CanvasRenderingContext2D, n: number, chosen: boolean): void {
    const { state } = this;
    const w = state.set?.wrinkles[n];
    const shape = w && state.shapeOf(w);
    if (!w || !shape) return;
    const bad = state.faults.some((f) => f.set === state.selection.set || f.shape === w.shape) && chosen;
    const colour = bad ? INK.fault : w.intensity < 0 ? INK.valley : INK.ridge;
    const points = state.pointsOf(n);
    const tinted = chosen || this.hovered?.wrinkle === n;
    shape.branches.forEach((branch, b) => {
      const curve = sampled(points[b] ?? []);
      if (chosen) paintWidth(ink, this.there, branch, curve, w.thickness, colour);
      ink.lineJoin = ink.lineCap = "round";
      ink.strokeStyle = "rgba(0,0,0,0.55)";
      ink.lineWidth = chosen && b === state.selection.branch ? 4.5 : 3.5;
      path(ink, this.there, curve.map((c) => c.at));
      ink.stroke();
      ink.strokeStyle = tinted ? colour : INK.other;
      ink.lineWidth = chosen && b === state.selection.branch ? 2.2 : 1.4;
      ink.stroke();
    });
    if (!chosen) return;
    shape.branches.forEach((branch, b) =>
      (points[b] ?? []).forEach((p, k) => {
        const end = k === 0 ? branch.start : k === branch.points.length - 1 ? branch.end : null;
        paintPoint(ink, this.there, p, colour, end, b === state.selection.branch && k === state.selection.point);
      }),
    );
    const handle = this.widthHandle();
    const at = points[state.selection.branch]?.[state.selection.point];
    if (handle && at) {
      path(ink, this.there, [at, handle]);
      ink.strokeStyle = INK.bright;
      ink.lineWidth = 1;
      ink.stroke();
      const [x, y] = this.toScreen(handle);
      ink.fillStyle = INK.bright;
      ink.fillRect(x - 3.5, y - 3.5, 7, 7);
    }
  }

  private paintDrawing(ink: CanvasRenderingContext2D): void {
    if (this.state.tool === "select") return;
    const places = this.hover && this.drawn.length > 0 ? [...this.drawn, this.hover] : this.drawn;
    if (places.length >= 2) {
      path(ink, this.there, sampled(places).map((c) => c.at));
      ink.strokeStyle = INK.ridge;
      ink.lineWidth = 2;
      ink.setLineDash([6, 4]);
      ink.stroke();
      ink.setLineDash([]);
    }
    for (const p of this.drawn) paintPoint(ink, this.there, p, INK.ridge, null, false);
  }
}
