// watch/messages.ts
var HEAD_BYTES = 16;
var KEY_PICTURE = 1;
var SOUND = 2;
function packetOf(message) {
  const view = new DataView(message);
  return { kind: view.getUint8(0), tUs: Number(view.getBigUint64(8, true)), data: new Uint8Array(message, HEAD_BYTES) };
}

// watch/connection.ts
var SILENT_MS = 4e3;
var PING_MS = 2e3;
var PINGS = 10;
var FIRST_WAIT_MS = 500;
var MOST_WAIT_MS = 5e3;
var ENDED = 1001;
var UNREACHED = 1006;
var LOST = "The picture does not come; trying again.";
var Connection = class {
  constructor(address2, listener) {
    this.address = address2;
    this.listener = listener;
    this.open();
    setInterval(() => this.look(), PING_MS);
  }
  address;
  listener;
  socket = null;
  wait = FIRST_WAIT_MS;
  heardAt = 0;
  ended = false;
  pings = [];
  /** Conference time now [ms], NaN while it is not known. */
  now() {
    if (this.pings.length === 0) return NaN;
    const best = this.pings.reduce((a, b) => b.trip < a.trip ? b : a);
    return performance.now() + best.offset;
  }
  open() {
    const socket = new WebSocket(this.address);
    socket.binaryType = "arraybuffer";
    this.socket = socket;
    this.heardAt = performance.now();
    socket.onopen = () => this.ping();
    socket.onmessage = (event) => {
      this.heardAt = performance.now();
      this.wait = FIRST_WAIT_MS;
      if (typeof event.data === "string") this.hear(JSON.parse(event.data));
      else this.listener.packet(packetOf(event.data));
    };
    socket.onclose = (event) => {
      if (this.socket !== socket) return;
      this.socket = null;
      this.pings = [];
      this.ended = event.code === ENDED || this.ended && event.code === UNREACHED;
      this.listener.trouble(this.ended ? "The conference has ended. This page waits for the next one." : LOST);
      setTimeout(() => this.open(), this.wait);
      this.wait = Math.min(2 * this.wait, MOST_WAIT_MS);
    };
  }
  hear(words) {
    if (words.kind === "pong") {
      const now = performance.now();
      const trip = now - words.ping;
      this.pings.push({ trip, offset: words.t_ms + trip / 2 - now });
      if (this.pings.length > PINGS) this.pings.shift();
    } else if (words.kind === "hello") {
      this.ended = false;
      this.listener.trouble(null);
    }
    this.listener.words(words);
  }
  /** Something for the renderer, where it is there. */
  say(words) {
    if (this.socket?.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(words));
  }
  ping() {
    this.say({ ping: performance.now() });
  }
  look() {
    if (this.socket && performance.now() - this.heardAt > SILENT_MS) this.socket.close();
    this.ping();
  }
};

// watch/picture.ts
var MOST_WAITING = 4;
var canDecode = "VideoDecoder" in window;
var Picture = class {
  /** shown: is told of each picture that is on the page, with the conference time at which it was drawn [us]; wantKey: asks for
   * one that stands for itself. */
  constructor(canvas2, shown2, wantKey) {
    this.canvas = canvas2;
    this.shown = shown2;
    this.wantKey = wantKey;
    const ink = canvas2.getContext("2d", { alpha: false });
    if (!ink) throw new Error("no 2D canvas");
    this.ink = ink;
  }
  canvas;
  shown;
  wantKey;
  ink;
  decoder = null;
  lost = true;
  show(packet) {
    if (!canDecode) {
      void this.showJpeg(packet);
      return;
    }
    const key = packet.kind === KEY_PICTURE;
    if (key && (this.lost || this.decoder?.state !== "configured")) this.begin(packet.data);
    if (this.lost || !this.decoder) return;
    if (this.decoder.decodeQueueSize > MOST_WAITING && !key) {
      this.lose();
      return;
    }
    this.decoder.decode(new EncodedVideoChunk({ type: key ? "key" : "delta", timestamp: packet.tUs, data: packet.data }));
  }
  /** Nothing more comes of what was. */
  reset() {
    this.lost = true;
  }
  lose() {
    this.lost = true;
    this.wantKey();
  }
  begin(key) {
    const codec = codecOf(key);
    if (codec === null) return;
    if (this.decoder && this.decoder.state !== "closed") this.decoder.close();
    const decoder = new VideoDecoder({
      output: (frame) => {
        this.draw(frame, frame.displayWidth, frame.displayHeight, frame.timestamp);
        frame.close();
      },
      error: () => {
        if (this.decoder === decoder) this.lose();
      }
    });
    decoder.configure({ codec, optimizeForLatency: true });
    this.decoder = decoder;
    this.lost = false;
  }
  async showJpeg(packet) {
    const bitmap = await createImageBitmap(new Blob([packet.data], { type: "image/jpeg" }));
    this.draw(bitmap, bitmap.width, bitmap.height, packet.tUs);
    bitmap.close();
  }
  draw(image, width, height, tUs) {
    if (this.canvas.width !== width || this.canvas.height !== height) {
      this.canvas.width = width;
      this.canvas.height = height;
    }
    this.ink.drawImage(image, 0, 0);
    this.shown(tUs);
  }
};
function codecOf(annexB) {
  for (let i = 0; i + 6 < annexB.length; ++i) {
    if (annexB[i] === 0 && annexB[i + 1] === 0 && annexB[i + 2] === 1 && ((annexB[i + 3] ?? 0) & 31) === 7) {
      return "avc1." + Array.from(annexB.subarray(i + 4, i + 7), (b) => b.toString(16).padStart(2, "0")).join("");
    }
  }
  return null;
}

// watch/sound.ts
var RATE = 48e3;
var AHEAD_S = 0.03;
var JUMP_S = 0.04;
var MOST_WAIT_S = 1;
var canHear = "AudioDecoder" in window;
var Sound = class {
  /** now: conference time [ms]; pictureAge: of the picture that is seen now [s]. */
  constructor(now, pictureAge) {
    this.now = now;
    this.pictureAge = pictureAge;
    this.decoder = new AudioDecoder({ output: (data) => this.play(data), error: () => void 0 });
    this.decoder.configure({ codec: "opus", sampleRate: RATE, numberOfChannels: 2 });
  }
  now;
  pictureAge;
  context = new AudioContext({ sampleRate: RATE, latencyHint: "interactive" });
  decoder;
  next = 0;
  late = 0;
  put(packet) {
    if (this.decoder.state !== "configured") return;
    this.decoder.decode(new EncodedAudioChunk({ type: "key", timestamp: packet.tUs, data: packet.data }));
  }
  close() {
    if (this.decoder.state !== "closed") this.decoder.close();
    void this.context.close();
  }
  play(data) {
    const buffer = this.context.createBuffer(data.numberOfChannels, data.numberOfFrames, RATE);
    for (let channel = 0; channel < data.numberOfChannels; ++channel) {
      data.copyTo(buffer.getChannelData(channel), { planeIndex: channel, format: "f32-planar" });
    }
    const nowMs = this.now();
    const ahead = data.timestamp / 1e6 - nowMs / 1e3;
    data.close();
    if (Number.isNaN(nowMs)) return;
    const begin = this.context.currentTime;
    let at = begin + ahead + Math.min(MOST_WAIT_S, this.pictureAge() + AHEAD_S + this.late);
    if (at < begin) {
      this.late = Math.min(MOST_WAIT_S, this.late + begin - at + 0.01);
      at = begin;
    } else {
      this.late *= 0.999;
    }
    if (Math.abs(at - this.next) < JUMP_S && this.next >= begin) at = this.next;
    const source = this.context.createBufferSource();
    source.buffer = buffer;
    source.connect(this.context.destination);
    source.start(at);
    this.next = at + buffer.duration;
  }
};

// watch/main.ts
var SMOOTH = 0.1;
function part(id, kind) {
  const found = document.getElementById(id);
  if (!(found instanceof kind)) throw new Error(`the page lacks #${id}`);
  return found;
}
var canvas = part("picture", HTMLCanvasElement);
var line = part("state", HTMLElement);
var trouble = part("trouble", HTMLElement);
var soundButton = part("sound", HTMLButtonElement);
var fullButton = part("full", HTMLButtonElement);
var sound = null;
var shown = 0;
var counted = { pictures: 0, ages: 0, at: performance.now() };
var ages = 0;
var ageMs = NaN;
var size = "";
var picture = new Picture(
  canvas,
  (tUs) => {
    const age = connection.now() - tUs / 1e3;
    if (Number.isNaN(age)) return;
    shown += 1;
    ages += age;
    ageMs = Number.isNaN(ageMs) ? age : ageMs + SMOOTH * (age - ageMs);
  },
  () => connection.say({ lost: true })
);
function hear(words) {
  if (words.kind === "hello") {
    document.title = `VISTEL ${words.site}`;
    size = `${words.width} × ${words.height}`;
    soundButton.hidden = !(words.sound && canHear);
    picture.reset();
  } else if (words.kind === "state") {
    tell(words);
  }
}
function tell(state) {
  const now = performance.now();
  const rate = (shown - counted.pictures) * 1e3 / (now - counted.at);
  const drawn = state.rate.toFixed(0);
  const seenMs = Math.max(0, (ages - counted.ages) / (shown - counted.pictures));
  counted = { pictures: shown, ages, at: now };
  const said = [
    size,
    // What waited on the way comes in a burst: more than were drawn meanwhile.
    rate.toFixed(0) === drawn || rate > state.rate ? `${rate.toFixed(0)} pictures/s` : `${rate.toFixed(0)} of ${drawn} pictures/s`,
    Number.isNaN(seenMs) ? "" : `picture ${seenMs.toFixed(0)} ms old`,
    Number.isNaN(seenMs) ? "" : `motions ${(state.motion_age_ms + seenMs).toFixed(0)} ms`,
    canDecode ? "" : "as JPEG: open by localhost for less traffic and for sound"
  ];
  line.textContent = said.filter((s) => s).join(" · ");
  line.dataset["rate"] = rate.toFixed(2);
  line.dataset["ageMs"] = seenMs.toFixed(2);
}
function take(packet) {
  if (packet.kind === SOUND) sound?.put(packet);
  else picture.show(packet);
}
function say(text) {
  trouble.textContent = text ?? "";
  trouble.hidden = text === null;
  if (text !== null) line.textContent = "";
}
var address = `${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/stream${canDecode ? "" : "?form=jpeg"}`;
var connection = new Connection(address, { words: hear, packet: take, trouble: say });
soundButton.onclick = () => {
  if (sound) {
    sound.close();
    sound = null;
  } else {
    sound = new Sound(() => connection.now(), () => Number.isNaN(ageMs) ? 0 : Math.max(0, ageMs) / 1e3);
  }
  soundButton.setAttribute("aria-pressed", String(sound !== null));
  soundButton.textContent = sound ? "Sound off" : "Sound on";
};
fullButton.onclick = () => {
  if (document.fullscreenElement) void document.exitFullscreen();
  else void document.documentElement.requestFullscreen();
};
