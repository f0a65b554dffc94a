// How curves of wrinkles are drawn.

import { FONT, INK } from "./colours";
import { words } from "./dom";
import { attribute, clamp, sub, type OnCurve } from "./geometry";
import type { Branch, Vec } from "./types";

/** How far beyond once round a plane is shown, in turns: curves may cross its seam. */
export const AROUND = 0.5;

/** From the plane to the canvas. */
export type Place = (p: Vec) => Vec;

/** Begins a path through places. */
export function path(ink: CanvasRenderingContext2D, there: Place, curve: Vec[]): void {
  ink.beginPath();
  curve.forEach((p, k) => {
    const [x, y] = there(p);
    if (k === 0) ink.moveTo(x, y);
    else ink.lineTo(x, y);
  });
}

/** The band within the wrinkle's radius, fainter where its intensity is less. */
export function paintWidth(
  ink: CanvasRenderingContext2D,
  there: Place,
  branch: Branch,
  curve: OnCurve[],
  radius: number,
  colour: string,
): void {
  ink.save();
  ink.fillStyle = colour;
  const left: Vec[] = [];
  const right: Vec[] = [];
  curve.forEach((c, k) => {
    const before = (curve[Math.max(0, k - 1)] as OnCurve).at;
    const after = (curve[Math.min(curve.length - 1, k + 1)] as OnCurve).at;
    const d = sub(after, before);
    const length = Math.hypot(...d) || 1;
    const r = (radius * attribute(branch, "thickness", c) * Math.sqrt(Math.abs(attribute(branch, "intensity", c)))) / length;
    left.push([c.at[0] - d[1] * r, c.at[1] + d[0] * r]);
    right.push([c.at[0] + d[1] * r, c.at[1] - d[0] * r]);
  });
  path(ink, there, [...left, ...right.reverse()]);
  ink.closePath();
  ink.globalAlpha = 0.16;
  ink.fill();
  ink.globalAlpha = 0.5;
  ink.lineWidth = 0.75;
  ink.strokeStyle = colour;
  ink.stroke();
  ink.restore();
}

/** A control point; `end`: how the curve ends there. */
export function paintPoint(
  ink: CanvasRenderingContext2D,
  there: Place,
  p: Vec,
  colour: string,
  end: string | null,
  chosen: boolean,
): void {
  const [x, y] = there(p);
  ink.beginPath();
  if (end === "taper") {
    ink.moveTo(x, y - 6);
    ink.lineTo(x + 6, y);
    ink.lineTo(x, y + 6);
    ink.lineTo(x - 6, y);
    ink.closePath();
  } else ink.arc(x, y, chosen ? 5.5 : 4.5, 0, 2 * Math.PI);
  ink.fillStyle = chosen ? INK.bright : end === "vanish" ? INK.back : colour;
  ink.fill();
  ink.strokeStyle = chosen ? colour : end === "vanish" ? colour : "rgba(0,0,0,0.7)";
  ink.lineWidth = chosen ? 2.5 : 1.5;
  ink.stroke();
}

/** The picture of a region's plane, fainter where it goes on beyond once round, and where its joints are. */
export function paintPlane(
  ink: CanvasRenderingContext2D,
  there: Place,
  plane: Vec,
  picture: HTMLCanvasElement | null,
  knots: [string, number][],
): void {
  const h = plane[1];
  const [left, top] = there([0, h]);
  const [right, bottom] = there([plane[0], 0]);
  const width = right - left;
  const height = bottom - top;
  ink.save();
  ink.beginPath();
  ink.rect(left - AROUND * width, top, (1 + 2 * AROUND) * width, height);
  ink.clip();
  for (const k of [-1, 0, 1]) {
    ink.globalAlpha = k === 0 ? 1 : 0.28;
    if (picture) ink.drawImage(picture, left + k * width, top, width, height);
    else {
      ink.fillStyle = "#26282c";
      ink.fillRect(left + k * width, top, width, height);
    }
  }
  ink.restore();
  ink.strokeStyle = INK.line;
  ink.lineWidth = 1;
  ink.strokeRect(Math.round(left) + 0.5, Math.round(top) + 0.5, Math.round(width), Math.round(height));
  ink.font = FONT;
  ink.textBaseline = "middle";
  for (const [joint, v] of knots) {
    const y = Math.round(there([0, clamp(v, 0, 1) * h])[1]) + 0.5;
    ink.strokeStyle = INK.line;
    ink.setLineDash([3, 5]);
    ink.beginPath();
    ink.moveTo(left - AROUND * width, y);
    ink.lineTo(left + width * (1 + AROUND), y);
    ink.stroke();
    ink.setLineDash([]);
    ink.fillStyle = INK.text;
    ink.textAlign = "left";
    ink.fillText(words(joint), Math.max(8, left - AROUND * width + 6), y + (v >= 1 ? 10 : -9));
  }
}
