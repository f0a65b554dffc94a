// The page of a site's stream: picture, voices, and a line that says how it goes.
import { Connection } from "./connection";
import { SOUND, type Packet, type State, type Words } from "./messages";
import { Picture, canDecode } from "./picture";
import { Sound, canHear } from "./sound";

const SMOOTH = 0.1;

function part<T extends HTMLElement>(id: string, kind: new () => T): T {
  const found = document.getElementById(id);
  if (!(found instanceof kind)) throw new Error(`the page lacks #${id}`);
  return found;
}

const canvas = part("picture", HTMLCanvasElement);
const line = part("state", HTMLElement);
const trouble = part("trouble", HTMLElement);
const soundButton = part("sound", HTMLButtonElement);
const fullButton = part("full", HTMLButtonElement);

let sound: Sound | null = null;
let shown = 0;
let counted = { pictures: 0, ages: 0, at: performance.now() };
let ages = 0; // of all pictures shown [ms]
let ageMs = NaN; // smoothed: sound follows it
let size = "";

const picture = new Picture(
  canvas,
  (tUs) => {
    const age = connection.now() - tUs / 1e3;
    if (Number.isNaN(age)) return;
    shown += 1;
    ages += age;
    ageMs = Number.isNaN(ageMs) ? age : ageMs + SMOOTH * (age - ageMs);
  },
  () => connection.say({ lost: true }),
);

function hear(words: Words): void {
  if (words.kind === "hello") {
    document.title = `VISTEL ${words.site}`;
    size = `${words.width} × ${words.height}`;
    soundButton.hidden = !(words.sound && canHear);
    picture.reset();
  } else if (words.kind === "state") {
    tell(words);
  }
}

function tell(state: State): void {
  const now = performance.now();
  const rate = ((shown - counted.pictures) * 1e3) / (now - counted.at);
  const drawn = state.rate.toFixed(0);
  const seenMs = Math.max(0, (ages - counted.ages) / (shown - counted.pictures)); // of the last second; NaN: none was shown
  counted = { pictures: shown, ages, at: now };
  const said = [
    size,
    // What waited on the way comes in a burst: more than were drawn meanwhile.
    rate.toFixed(0) === drawn || rate > state.rate ? `${rate.toFixed(0)} pictures/s` : `${rate.toFixed(0)} of ${drawn} pictures/s`,
    Number.isNaN(seenMs) ? "" : `picture ${seenMs.toFixed(0)} ms old`,
    Number.isNaN(seenMs) ? "" : `motions ${(state.motion_age_ms + seenMs).toFixed(0)} ms`,
    canDecode ? "" : "as JPEG: open by localhost for less traffic and for sound",
  ];
  line.textContent = said.filter((s) => s).join(" · ");
  line.dataset["rate"] = rate.toFixed(2);
  line.dataset["ageMs"] = seenMs.toFixed(2);
}

function take(packet: Packet): void {
  if (packet.kind === SOUND) sound?.put(packet);
  else picture.show(packet);
}

function say(text: string | null): void {
  trouble.textContent = text ?? "";
  trouble.hidden = text === null;
  if (text !== null) line.textContent = "";
}

const address = `${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/stream${canDecode ? "" : "?form=jpeg"}`;
const connection = new Connection(address, { words: hear, packet: take, trouble: say });

soundButton.onclick = () => {
  if (sound) {
    sound.close();
    sound = null;
  } else {
    sound = new Sound(() => connection.now(), () => (Number.isNaN(ageMs) ? 0 : Math.max(0, ageMs) / 1e3));
  }
  soundButton.setAttribute("aria-pressed", String(sound !== null));
  soundButton.textContent = sound ? "Sound off" : "Sound on";
};

fullButton.onclick = () => {
  if (document.fullscreenElement) void document.exitFullscreen();
  else void document.documentElement.requestFullscreen();
};
