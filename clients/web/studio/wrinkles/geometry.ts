// Curves of wrinkles on the plane of a region: where they are, and how they are changed. Lengths in metres of somebody 1.75 m tall.

import type { Branch, Form, Shape, Vec, Wrinkle } from "./types";

/** How close ends of branches must come to another curve to lie on it, in the shape's unit (vistel.wrinkle.shape.TOUCH). */
export const TOUCH = 0.02;

export const sub = (a: Vec, b: Vec): Vec => [a[0] - b[0], a[1] - b[1]];
export const add = (a: Vec, b: Vec): Vec => [a[0] + b[0], a[1] + b[1]];
export const scale = (a: Vec, by: number): Vec => [a[0] * by, a[1] * by];
export const distance = (a: Vec, b: Vec): number => Math.hypot(a[0] - b[0], a[1] - b[1]);
export const mix = (a: number, b: number, t: number): number => a + (b - a) * t;
export const clamp = (x: number, low: number, high: number): number => Math.min(high, Math.max(low, x));
const round = (x: number): number => Math.round(x * 1e5) / 1e5;

/** A place on a curve: span and share of the way along it. */
export interface OnCurve {
  at: Vec;
  span: number;
  t: number;
}

/** A centripetal Catmull-Rom curve through points, the same as vistel.wrinkle.curve.sampled. */
export function sampled(points: Vec[], count = 20): OnCurve[] {
  const first = points[0];
  if (!first) return [];
  const out: OnCurve[] = [{ at: first, span: 0, t: 0 }];
  const at = (k: number): Vec => {
    const n = points.length;
    if (k < 0) return sub(scale(points[0] as Vec, 2), points[1] as Vec);
    if (k >= n) return sub(scale(points[n - 1] as Vec, 2), points[n - 2] as Vec);
    return points[k] as Vec;
  };
  for (let k = 0; k + 1 < points.length; k++) {
    const p = [at(k - 1), at(k), at(k + 1), at(k + 2)] as const;
    const knot = [0];
    for (let j = 0; j < 3; j++) {
      knot.push((knot[j] as number) + Math.sqrt(Math.max(distance(p[j] as Vec, p[j + 1] as Vec), 1e-12)));
    }
    const [u0, u1, u2, u3] = knot as [number, number, number, number];
    for (let i = 1; i <= count; i++) {
      const u = mix(u1, u2, i / count);
      const between = (ua: number, ub: number, a: Vec, b: Vec): Vec => [
        ((ub - u) * a[0] + (u - ua) * b[0]) / (ub - ua),
        ((ub - u) * a[1] + (u - ua) * b[1]) / (ub - ua),
      ];
      const a1 = between(u0, u1, p[0], p[1]);
      const a2 = between(u1, u2, p[1], p[2]);
      const a3 = between(u2, u3, p[2], p[3]);
      const b1 = between(u0, u2, a1, a2);
      const b2 = between(u1, u3, a2, a3);
      out.push({ at: between(u1, u2, b1, b2), span: k, t: i / count });
    }
  }
  return out;
}

/** The place of a curve nearest to a point, and how far it is. */
export function nearest(curve: OnCurve[], to: Vec): { place: OnCurve; away: number } | null {
  let best: { place: OnCurve; away: number } | null = null;
  for (let k = 0; k + 1 < curve.length; k++) {
    const a = curve[k] as OnCurve;
    const b = curve[k + 1] as OnCurve;
    const d = sub(b.at, a.at);
    const length = d[0] * d[0] + d[1] * d[1];
    const t = length > 0 ? clamp(((to[0] - a.at[0]) * d[0] + (to[1] - a.at[1]) * d[1]) / length, 0, 1) : 0;
    const at = add(a.at, scale(d, t));
    const away = distance(at, to);
    if (!best || away < best.away) {
      const start = a.span === b.span ? a.t : 0;
      best = { place: { at, span: b.span, t: mix(start, b.t, t) }, away };
    }
  }
  return best;
}

function spread(size: number | Vec): Vec {
  return typeof size === "number" ? [size, size] : size;
}

/** Where a shape's unit comes to lie on the plane. */
export function onPlane(w: Wrinkle, plane: Vec, p: Vec): Vec {
  const [across, along] = spread(w.size);
  const x = p[0] * (w.mirrored ? -across : across);
  const y = p[1] * along;
  const angle = (w.turn * Math.PI) / 180;
  const c = Math.cos(angle);
  const s = Math.sin(angle);
  return [w.at[0] * plane[0] + c * x - s * y, w.at[1] * plane[1] + s * x + c * y];
}

/** Control points of every branch on the plane; moved: where wrinkledness puts them in the shape's unit. */
export function controlPoints(w: Wrinkle, shape: Shape, plane: Vec, moved?: Vec[][]): Vec[][] {
  return shape.branches.map((branch, b) =>
    branch.points.map((point, k) => onPlane(w, plane, moved?.[b]?.[k] ?? point.at)),
  );
}

/** A name that no shape has yet. */
export function freshName(base: string, taken: Iterable<string>): string {
  const known = new Set(taken);
  const stem = base.replace(/_\d+$/, "");
  for (let k = 2; ; k++) if (!known.has(`${stem}_${k}`)) return `${stem}_${k}`;
}

/** Makes a shape of the wrinkle's own of what is drawn: transforms and wrinkledness become part of its points. The form is
 * changed in place. */
export function owned(form: Form, w: Wrinkle, shape: Shape, builtin: Record<string, Shape>): Shape {
  const users = form.sets.flatMap((s) => s.wrinkles).filter((other) => other.shape === w.shape).length;
  let own = form.shapes.find((s) => s.name === w.shape);
  if (!own || users > 1) {
    own = structuredClone(shape);
    own.name = freshName(w.shape, [...Object.keys(builtin), ...form.shapes.map((s) => s.name)]);
    form.shapes.push(own);
    w.shape = own.name;
  }
  if (w.mirrored) {
    for (const layer of own.profile) {
      layer.offset = -layer.offset;
      layer.lean = -layer.lean;
    }
  }
  return own;
}

/** Puts the points of a wrinkle's own shape where they are said to be on the plane: its frame becomes their box. */
export function refit(w: Wrinkle, shape: Shape, plane: Vec, points: Vec[][]): void {
  const every = points.flat();
  const low: Vec = [Math.min(...every.map((p) => p[0])), Math.min(...every.map((p) => p[1]))];
  const high: Vec = [Math.max(...every.map((p) => p[0])), Math.max(...every.map((p) => p[1]))];
  const half = Math.max(high[0] - low[0], high[1] - low[1], 1e-3) / 2;
  const middle = scale(add(low, high), 0.5);
  w.at = [round(middle[0] / plane[0]), round(middle[1] / plane[1])];
  const unit = Math.ceil(half * 1e5) / 1e5;
  w.size = unit;
  w.turn = 0;
  w.mirrored = false;
  w.wrinkledness = 0;
  const there: Vec = [w.at[0] * plane[0], w.at[1] * plane[1]];
  shape.branches.forEach((branch, b) => {
    branch.points.forEach((point, k) => {
      const p = sub((points[b] as Vec[])[k] as Vec, there);
      point.at = [round(clamp(p[0] / unit, -1, 1)), round(clamp(p[1] / unit, -1, 1))];
    });
  });
}

/** Shapes that no wrinkle wears any more go. */
export function tidied(form: Form): void {
  const worn = new Set(form.sets.flatMap((s) => s.wrinkles).map((w) => w.shape));
  form.shapes = form.shapes.filter((s) => worn.has(s.name));
}

/** An attribute along a branch, level at every control point, as the synthesis blends it. */
export function attribute(branch: Branch, of: "intensity" | "thickness", place: OnCurve): number {
  const value = (k: number): number => {
    const point = branch.points[k];
    if (!point) return 0;
    if (of === "thickness") return point.thickness;
    const gone =
      (k === 0 && branch.start === "vanish") || (k === branch.points.length - 1 && branch.end === "vanish");
    return gone ? 0 : point.intensity;
  };
  const t = place.t * place.t * (3 - 2 * place.t);
  return mix(value(place.span), value(place.span + 1), t);
}
