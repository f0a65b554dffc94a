// What the camera sees, as in a mirror, with what is found in it, and a line that says how it goes.
import type { Camera } from "./camera";
import type { Landmark } from "./landmarks";
import { text } from "./words";

const WIDTH = 200;
const HEIGHT = 150;
const FIRST_OF_FINGERS = [1, 5, 9, 13, 17];
const LIMBS: [number, number][] = [[15, 13], [13, 11], [11, 12], [12, 14], [14, 16], [11, 23], [12, 24]];
const FACE_EVERY = 6; // of its points one is drawn
const SEEN = 0.5; // visibility from which a point counts
const SLOW_MS = 250; // for a picture
const COLOUR = "#8fe3a8";

const canvas = document.createElement("canvas");
[canvas.width, canvas.height] = [WIDTH, HEIGHT];

/** Draw what is seen now. */
export function drawMirror(camera: Camera): void {
  const to = canvas.getContext("2d")!;
  const { video, seen } = camera;
  const scale = Math.max(WIDTH / Math.max(1, video.videoWidth), HEIGHT / Math.max(1, video.videoHeight));
  const [wide, high] = [video.videoWidth * scale, video.videoHeight * scale];
  to.setTransform(-1, 0, 0, 1, WIDTH, 0);
  to.translate((WIDTH - wide) / 2, (HEIGHT - high) / 2);
  to.drawImage(video, 0, 0, wide, high);
  to.strokeStyle = to.fillStyle = COLOUR;
  to.lineWidth = 1.5;
  const line = (points: (Landmark | undefined)[]) => {
    to.beginPath();
    for (const p of points) if (p && (p.visibility ?? 1) > SEEN) to.lineTo(p.x * wide, p.y * high);
    to.stroke();
  };
  for (const [a, b] of LIMBS) line([seen.body?.[a], seen.body?.[b]]);
  for (const hand of [seen.left, seen.right]) for (const n of FIRST_OF_FINGERS) if (hand) line([hand[0], ...hand.slice(n, n + 4)]);
  seen.face?.forEach((p, n) => n % FACE_EVERY || to.fillRect(p.x * wide - 0.5, p.y * high - 0.5, 1, 1));
  to.setTransform(1, 0, 0, 1, 0, 0);
}

/** The button that turns the camera on and off. */
export function CameraButton({ camera }: { camera: Camera }) {
  const on = camera.state === "on" || camera.state === "loading";
  return (
    <button type="button" id="camera" aria-pressed={on} disabled={camera.state === "asking"} onClick={() => (on ? camera.close() : void camera.open())}>
      {text(`cam_${camera.state}`)}
    </button>
  );
}

/** The mirror, while the camera is on. */
export function Mirror({ camera }: { camera: Camera }) {
  const left = Math.ceil(camera.calibrates);
  const late = camera.tookMs > SLOW_MS ? text("cam_slow", (camera.tookMs / 1000).toFixed(1)) : text("cam_seen");
  const told = camera.note ? text(`note_${camera.note}`) : left ? text("cam_raise", String(left)) : late;
  return (
    <>
      <span ref={(at) => at?.append(canvas)} />
      <p role="status" id="note">{camera.state === "loading" ? text("cam_fetches") : told}</p>
      {camera.state === "on" && left === 0 && (
        <button type="button" onClick={() => camera.calibrate()}>{text("cam_again")}</button>
      )}
      <p class="faint">{text("cam_stays")}</p>
    </>
  );
}
