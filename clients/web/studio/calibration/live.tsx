// What the devices see: receivers from two sides with their trails, how far a hand's joints are bent, a camera's picture.
import { useEffect, useRef } from "preact/hooks";
import { text } from "./words";

export interface Live {
  receivers?: Record<string, [number, number, number]>;
  angles?: number[];
  picture?: string;
}

const TRAIL = 60; // places that are remembered
const WIDE_M = 2.1; // of what is seen: arms stretched out
const HIGH_M = 1.7;
const DOT_PX = 6;
const FINGERS = ["thumb", "index", "middle", "ring", "little"] as const;
const MOST_DEG = 110;
const LEAST_DEG = -30;

const trails = new Map<string, [number, number, number][]>();

/** Forget where receivers were. */
export function forget(): void {
  trails.clear();
}

/** A trail grows while its receiver moves. */
export function remember(receivers: Record<string, [number, number, number]>): void {
  for (const [name, at] of Object.entries(receivers)) {
    const trail = trails.get(name) ?? [];
    trails.set(name, trail);
    const last = trail[trail.length - 1];
    if (!last || at.some((x, k) => x !== last[k])) trail.push(at);
    if (trail.length > TRAIL) trail.shift();
  }
}

export function LiveView({ live }: { live: Live }) {
  if (live.picture) return <div class="live"><img src={live.picture} alt={text("live")} /></div>;
  if (live.receivers) return <Drawing draw={drawReceivers} data={live.receivers} />;
  if (live.angles) return <Drawing draw={drawHand} data={live.angles} />;
  return null;
}

function Drawing<Data>({ draw, data }: { draw(to: Sheet, data: Data): void; data: Data }) {
  const canvas = useRef<HTMLCanvasElement>(null);
  useEffect(() => {
    const at = canvas.current!;
    const ratio = devicePixelRatio || 1;
    const [width, height] = [at.clientWidth, at.clientHeight];
    [at.width, at.height] = [width * ratio, height * ratio];
    const to = at.getContext("2d")!;
    to.scale(ratio, ratio);
    const style = getComputedStyle(at); // live: it follows what is set below
    to.font = `13px ${style.fontFamily}`;
    const colour = (name: string) => {
      at.style.color = `var(--${name})`;
      return style.color; // as a colour of day or night, which a canvas cannot choose itself
    };
    draw({ to, width, height, colour }, data);
  });
  return <div class="live"><canvas ref={canvas} role="img" aria-label={text("live")} /></div>;
}

interface Sheet {
  to: CanvasRenderingContext2D;
  width: number;
  height: number;
  colour(name: string): string; // of the page's style
}

/** Trackers have X ahead, Y to the right and Z down; a person who faces the transmitter is seen from there, and from above. */
function drawReceivers({ to, width, height, colour }: Sheet, receivers: Record<string, [number, number, number]>): void {
  const names = Object.keys(receivers);
  const middle = [0, 1, 2].map((k) => names.reduce((sum, name) => sum + receivers[name]![k]!, 0) / Math.max(1, names.length));
  const views = [
    { title: text("front"), across: 1, down: 2 },
    { title: text("above"), across: 1, down: 0 },
  ];
  const wide = width / views.length;
  const scale = Math.min(wide / WIDE_M, height / HIGH_M);
  views.forEach(({ title, across, down }, n) => {
    const place = (at: [number, number, number]): [number, number] => [
      wide * (n + 0.5) + (at[across]! - middle[across]!) * scale,
      height / 2 + (at[down]! - middle[down]!) * scale * (down === 0 ? -1 : 1),
    ];
    to.save();
    to.beginPath();
    to.rect(wide * n, 0, wide, height);
    to.clip();
    to.fillStyle = colour("faint");
    to.fillText(title, wide * n + 8, 16);
    names.forEach((name, k) => {
      const hue = colour(`curve-${k % 8}`);
      to.strokeStyle = to.fillStyle = hue;
      to.globalAlpha = 0.45;
      to.beginPath();
      for (const at of trails.get(name) ?? []) to.lineTo(...place(at));
      to.stroke();
      to.globalAlpha = 1;
      const [x, y] = place(receivers[name]!);
      to.beginPath();
      to.arc(x, y, DOT_PX, 0, 2 * Math.PI);
      to.fill();
      const left = x > wide * (n + 0.7);
      to.textAlign = left ? "right" : "left";
      to.fillText(name, x + (left ? -1 : 1) * (DOT_PX + 4), y + 4);
    });
    to.restore();
  });
}

function drawHand({ to, width, height, colour }: Sheet, angles: number[]): void {
  const wide = width / FINGERS.length;
  const bar = Math.min(26, (wide - 16) / 4);
  const zero = 24 + ((height - 48) * MOST_DEG) / (MOST_DEG - LEAST_DEG);
  const scale = (height - 48) / (MOST_DEG - LEAST_DEG);
  to.strokeStyle = colour("line");
  to.beginPath();
  to.moveTo(0, zero);
  to.lineTo(width, zero);
  to.stroke();
  FINGERS.forEach((finger, n) => {
    const left = wide * n + (wide - 4 * bar) / 2;
    for (let k = 0; k < 4; k++) {
      const degrees = Math.min(MOST_DEG, Math.max(LEAST_DEG, angles[4 * n + k] ?? 0));
      to.fillStyle = colour(`curve-${k}`);
      to.fillRect(left + k * bar + 1, zero - Math.max(0, degrees) * scale, bar - 2, Math.max(1, Math.abs(degrees) * scale));
    }
    to.fillStyle = colour("faint");
    to.textAlign = "center";
    to.fillText(text(finger), wide * (n + 0.5), height - 6);
  });
}
