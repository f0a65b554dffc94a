// How a photographed texture is laid on an island by pins: the similarity that brings pinned places of the surface nearest to
// where they belong on the picture, and the numbers by which the avatar's file keeps it (vistel.figure.avatar.texture).

import { add, sub } from "./geometry";
import type { Lying, Pin, Vec } from "./types";

/** q = (a x - b y, b x + a y) + t, in texels of the picture. */
export interface Similarity {
  a: number;
  b: number;
  t: Vec;
}

export function applied(s: Similarity, p: Vec): Vec {
  return [s.a * p[0] - s.b * p[1] + s.t[0], s.b * p[0] + s.a * p[1] + s.t[1]];
}

/** The similarity of least squares; one pin moves, two also turn and scale. `from` and `to` in texels. */
export function solved(from: Vec[], to: Vec[], before: Similarity): Similarity {
  const n = from.length;
  if (n === 0) return before;
  const mean = (points: Vec[]): Vec => {
    const sum = points.reduce(add, [0, 0]);
    return [sum[0] / n, sum[1] / n];
  };
  const p = mean(from);
  const q = mean(to);
  let { a, b } = before;
  let along = 0;
  let across = 0;
  let size = 0;
  for (let k = 0; k < n; k++) {
    const x = sub(from[k] as Vec, p);
    const y = sub(to[k] as Vec, q);
    along += x[0] * y[0] + x[1] * y[1];
    across += x[0] * y[1] - x[1] * y[0];
    size += x[0] * x[0] + x[1] * x[1];
  }
  if (n > 1 && size > 1e-9) {
    a = along / size;
    b = across / size;
  }
  const turned = applied({ a, b, t: [0, 0] }, p);
  return { a, b, t: sub(q, turned) };
}

/** What is kept of a similarity, about the middle of the island's coordinates. size: of the texture in texels. */
export function kept(island: number, s: Similarity, middle: Vec, size: Vec): Lying {
  const k = Math.hypot(s.a, s.b);
  const m: Vec = [middle[0] * size[0], middle[1] * size[1]];
  const w = sub(m, s.t);
  const back: Vec = [(s.a * w[0] + s.b * w[1]) / (k * k), (-s.b * w[0] + s.a * w[1]) / (k * k)];
  const move = sub(back, m);
  return { island, move: [move[0] / size[0], move[1] / size[1]], turn: -Math.atan2(s.b, s.a), scale: 1 / k };
}

/** The similarity of what is kept. */
export function ofKept(said: Lying | undefined, middle: Vec, size: Vec): Similarity {
  if (!said) return { a: 1, b: 0, t: [0, 0] };
  const k = 1 / said.scale;
  const a = k * Math.cos(-said.turn);
  const b = k * Math.sin(-said.turn);
  const m: Vec = [middle[0] * size[0], middle[1] * size[1]];
  const at = add(m, [said.move[0] * size[0], said.move[1] * size[1]]);
  return { a, b, t: sub(m, applied({ a, b, t: [0, 0] }, at)) };
}

/** How far each pin is from where it belongs [texels]. */
export function rest(pins: Pin[], s: Similarity, size: Vec): number[] {
  return pins.map((pin) => {
    const at = applied(s, [pin.from[0] * size[0], pin.from[1] * size[1]]);
    return Math.hypot(at[0] - pin.to[0] * size[0], at[1] - pin.to[1] * size[1]);
  });
}
