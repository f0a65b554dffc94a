// The worker that encodes what a guest shows live and sends it on a connection of its own: large pictures hold up no voice, and the
// page may be in the background. The bytes: vistel/protocol/pages/screen.py; the limits: vistel/protocol/pages/screen_parts.py.
export type ToEncoder =
  | { kind: "begin"; frames: ReadableStream<VideoFrame>; text: boolean } // text: letters are to be read, not movement seen
  | { kind: "go"; address: string; token: string }; // a panel is there
export type FromEncoder =
  | { kind: "ready"; width: number; height: number; codec: string }
  | { kind: "sent"; pictures: number; bytes: number }
  | { kind: "failed"; reason: string }; // empty: the connection is away

const CODECS = ["avc1.42e028", "vp09.00.40.08", "vp8"]; // the best first
const SIDE = 1600;
const PIXELS = 1600 * 1200;
const LEAST = 16;
const SETTLES_MS = 700; // a tab becomes smaller when the browser says above it that it is shown
const RATE = 10; // pictures a second
const KEY_MS = 2000; // from one key picture to the next
const BITS = 1_200_000; // a second, which encoders exceed now and then
const MOST_BYTES_MS = 1_500_000 / 8 / 1000; // over longer times
const AT_ONCE_BYTES = 500_000;
const BEHIND_BYTES = 300_000; // that the network has not taken yet: pictures are left out
const FINER = 5; // times that what rests is encoded again, which makes it finer
const HEAD_BYTES = 12;
const SCREEN = 10;

const tell = (said: FromEncoder) => postMessage(said);
let socket: WebSocket | null = null;
let encoder: VideoEncoder | null = null;
let config: VideoEncoderConfig | null = null;
let canvas: OffscreenCanvas | null = null;
let newest: VideoFrame | null = null;
let fresh = false; // it has not been encoded
let again = 0; // times that it has been encoded again
let keyAt = -Infinity; // of `performance` [ms]
let left = AT_ONCE_BYTES;
let leftAt = 0;
let [pictures, bytes] = [0, 0];
let going: { address: string; token: string } | null = null; // a panel is there

function fail(reason: string): void {
  tell({ kind: "failed", reason });
  socket?.close();
  close();
}

/** How large what is shown is sent: whole, and no larger than may be; of even sides, as encoders want them. */
function sizeOf(width: number, height: number): [number, number] {
  const scale = Math.min(1, SIDE / Math.max(width, height), Math.sqrt(PIXELS / (width * height)));
  const side = (length: number) => Math.max(LEAST, Math.floor((length * scale) / 2) * 2);
  return [side(width), side(height)];
}

async function choose(width: number, height: number, text: boolean): Promise<VideoEncoderConfig | null> {
  for (const codec of CODECS) {
    const wanted: VideoEncoderConfig & { contentHint?: string } = { codec, width, height, bitrate: BITS, framerate: RATE, latencyMode: "realtime" };
    if (text) wanted.contentHint = "text";
    if (codec.startsWith("avc1")) wanted.avc = { format: "annexb" };
    const { supported } = await VideoEncoder.isConfigSupported(wanted).catch(() => ({ supported: false }));
    if (supported) return wanted;
  }
  return null;
}

async function take(frames: ReadableStream<VideoFrame>, text: boolean): Promise<void> {
  const reader = frames.getReader();
  for (;;) {
    const { done, value } = await reader.read();
    if (done) return;
    if (!newest) setTimeout(() => void prepare(text), SETTLES_MS);
    newest?.close();
    [newest, fresh] = [value, true];
  }
}

async function prepare(text: boolean): Promise<void> {
  const [width, height] = sizeOf(newest!.displayWidth, newest!.displayHeight);
  config = await choose(width, height, text);
  if (!config) return fail("codec");
  tell({ kind: "ready", width, height, codec: config.codec });
  go(going);
}

/** The newest picture in the size that is sent; in the middle, where a window has become another. */
function pictureNow(frame: VideoFrame, { width, height }: VideoEncoderConfig, timestamp: number): VideoFrame {
  if (frame.displayWidth === width && frame.displayHeight === height) return new VideoFrame(frame, { timestamp });
  canvas ??= new OffscreenCanvas(width, height);
  const drawn = canvas.getContext("2d", { alpha: false })!;
  const scale = Math.min(width / frame.displayWidth, height / frame.displayHeight);
  const [wide, high] = [frame.displayWidth * scale, frame.displayHeight * scale];
  drawn.imageSmoothingQuality = "high";
  drawn.fillRect(0, 0, width, height);
  drawn.drawImage(frame, (width - wide) / 2, (height - high) / 2, wide, high);
  return new VideoFrame(canvas, { timestamp });
}

function step(): void {
  const now = performance.now();
  left = Math.min(AT_ONCE_BYTES, left + (now - leftAt) * MOST_BYTES_MS);
  leftAt = now;
  const key = now - keyAt >= KEY_MS;
  if (!newest || !config || !encoder || socket?.readyState !== WebSocket.OPEN) return;
  if (!fresh && !key && again >= FINER) return;
  if (left <= 0 || encoder.encodeQueueSize > 1 || socket.bufferedAmount > BEHIND_BYTES) return;
  again = fresh ? 0 : again + 1;
  fresh = false;
  if (key) keyAt = now;
  const picture = pictureNow(newest, config, Math.round(now * 1000));
  encoder.encode(picture, { keyFrame: key });
  picture.close();
}

function put(chunk: EncodedVideoChunk): void {
  const data = new ArrayBuffer(HEAD_BYTES + chunk.byteLength);
  const view = new DataView(data);
  [0x56, 0x50, SCREEN, chunk.type === "key" ? 1 : 0].forEach((byte, n) => view.setUint8(n, byte));
  view.setBigUint64(4, BigInt(chunk.timestamp), true);
  chunk.copyTo(new Uint8Array(data, HEAD_BYTES));
  socket?.send(data);
  left -= data.byteLength;
  [pictures, bytes] = [pictures + 1, bytes + data.byteLength];
  tell({ kind: "sent", pictures, bytes });
}

function go(to: typeof going): void {
  going = to;
  if (!going || !config || socket) return;
  const using = config;
  const { address, token } = going;
  socket = new WebSocket(address);
  socket.onmessage = ({ data }) => typeof data === "string" && fail((JSON.parse(data) as { reason?: string }).reason ?? "");
  socket.onclose = () => fail("");
  socket.onopen = () => {
    const { codec, width, height } = using;
    socket?.send(JSON.stringify({ token, codec, width, height }));
    encoder = new VideoEncoder({ output: put, error: (error) => fail(error.message) });
    encoder.configure(using);
    keyAt = -Infinity;
    setInterval(step, 1000 / RATE);
  };
}

onmessage = ({ data }: MessageEvent<ToEncoder>) => {
  if (data.kind === "begin") void take(data.frames, data.text).catch((error: unknown) => fail(String(error)));
  else go(data);
};
