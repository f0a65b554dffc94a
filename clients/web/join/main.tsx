// The page of a guest: whoever has the link chooses a person, enters, and is in the room, led by mouse and keys.
import { render } from "preact";
import { Vector3 } from "three";
import { Labels } from "../console/labels";
import { Link } from "../console/link";
import { Room } from "../console/room";
import { decode, type Frame, type Invited, type Joints, type Table, type Words } from "../console/wire";
import { Eyes } from "./eyes";
import { GESTURES, Gestures } from "./gestures";
import { Hand } from "./hand";
import { record } from "./record";

declare global {
  interface Window {
    /** For programs that drive the page. me: the guest's participant, once their figure is in the room; joints: places of somebody's
     * joints in the room [m]; seen: where a point of the room is on the page [px]; ready: how many have
     * their own figures; sent: bytes of what the guest does. */
    guest?: {
      me(): string | null;
      joints(name: string): [number, number, number][];
      thing(id: string): [number, number, number] | null;
      seen(at: [number, number, number]): [number, number];
      held(): [string, string, string][];
      own(): boolean;
      ready(): number;
      sent(): number;
      sharp(): void;
    };
  }
}

const SEND_MS = 1000 / 30;
const STILL_MS = 3000; // without a move of the pointer for so long, the head turns to who speaks
const SLOW_MS = 60; // from asking for a picture until it is drawn
const MOST_REST_MS = 300;
const FOLLOWS = 0.45; // share of where the pointer is in the picture by which the head turns to it
const HIGH = 0.5; // of the picture, from the middle to its edge, in units of its height

const element = <T extends HTMLElement>(id: string) => document.getElementById(id) as T;
const canvas = element<HTMLCanvasElement>("room");
const trouble = element("trouble");
const token = location.hash.slice(1);
const room = opened();
const labels = room && new Labels(room, element("labels"));
const gestures = new Gestures();
let joints: Joints | null = null;
let table: Table | null = null;
let invited: Invited | null = null;
let eyes: Eyes | null = null;
let hand: Hand | null = null;
let person = ""; // as whom the guest has entered
let sent = 0;
let movedAt = 0;
let askedAt = 0;
const pointer = { x: 0, y: 0, turning: false }; // where it is in the picture (-1 to 1, up)
let speaker = "";

function opened(): Room | null {
  try {
    const made = new Room(canvas);
    made.show(token);
    return made;
  } catch {
    return null;
  }
}

function hear(words: Words): void {
  if (words.kind === "hello") {
    document.title = `${words.conference} – VISTEL`;
    element("conference").textContent = words.conference;
  } else if (words.kind === "refused") {
    say(words.reason, true);
  } else if (words.kind === "invited") {
    invited = words;
    if (room && !eyes) {
      eyes = new Eyes(room, words.participant, words.seat);
      hand = new Hand(room, eyes, words.participant);
    }
    if (person) link.send(JSON.stringify({ person })); // after a break of the connection
    else showDoor(words);
  } else if (words.kind === "joints") {
    joints = words;
    room?.begin(words);
  } else if (words.kind === "table") {
    table = words;
    room?.receiveTable(words);
  } else if (words.kind === "held" && room) {
    room.held = words;
  }
}

function see(data: ArrayBuffer): void {
  const frame = joints && decode(data, joints);
  if (!frame) return;
  room?.receiveFrame(frame);
  speaker = who(frame.people.find((p) => p.talks && who(p) !== invited?.participant));
}

function who(person: Frame["people"][number] | undefined): string {
  return (person && table?.people[person.who]?.name) ?? "";
}

function say(text: string | null, over = false): void {
  trouble.hidden = text === null;
  trouble.textContent = text;
  if (!over) return;
  element("door").hidden = element("does").hidden = true;
}

/** Before the room: as whom to enter. */
function showDoor(words: Invited): void {
  const own = /person=(\w+)/.exec(words.avatar)?.[1] ?? "";
  const enter = (chosen: string) => {
    person = chosen;
    link.send(JSON.stringify({ person }));
    element("door").hidden = true;
    element("does").hidden = false;
    showDoes();
    canvas.focus();
  };
  render(
    <>
      <h2>Welcome, {words.name}</h2>
      <p>You will sit at the table as one of these people. Nothing is sent but what you do here with mouse and keys.</p>
      <div class="people">
        {words.people.map((name) => (
          <button type="button" key={name} aria-current={name === own} onClick={() => enter(name)}>
            {name[0]!.toUpperCase() + name.slice(1)}
          </button>
        ))}
      </div>
      {own && <p class="faint">{own[0]!.toUpperCase() + own.slice(1)} is ready at once; others may take some seconds to be seen.</p>}
    </>,
    element("door"),
  );
  element("door").hidden = false;
}

function showDoes(): void {
  render(
    <>
      {GESTURES.map(({ name, key }, n) => (
        <button type="button" key={name} onClick={() => gestures.make(n + 1)}>
          {name} <kbd>{key}</kbd>
        </button>
      ))}
      <span>Hold the left button on a thing to take it, on a person to touch them; the wheel brings the hand nearer or farther. Drag elsewhere to look round.</span>
    </>,
    element("does"),
  );
}

/** What the guest does now, thirty times a second; nothing while the page is in the background, where the figure rests. */
function tell(): void {
  if (!person || !eyes || !hand || document.hidden) return;
  let [yaw, pitch] = [eyes.yaw - pointer.x * FOLLOWS * canvas.clientWidth * HIGH / canvas.clientHeight, eyes.pitch + pointer.y * FOLLOWS * HIGH];
  const speaks = room?.figures.get(speaker);
  if (speaks && performance.now() - movedAt > STILL_MS) [yaw, pitch] = eyes.towards(speaks.joint("head").getWorldPosition(new Vector3()));
  const doing = { yaw, pitch, ...hand.led(pointer.x, pointer.y), ...gestures.newest };
  const data = record(doing);
  sent += data.byteLength;
  link.send(data);
}

function place(event: PointerEvent): void {
  const box = canvas.getBoundingClientRect();
  pointer.x = ((event.clientX - box.x) / box.width) * 2 - 1;
  pointer.y = 1 - ((event.clientY - box.y) / box.height) * 2;
  movedAt = performance.now();
}

canvas.addEventListener("pointerdown", (event) => {
  if (!person || !eyes || !hand) return;
  canvas.setPointerCapture(event.pointerId);
  place(event);
  pointer.turning = event.button !== 0 || !hand.press(pointer.x, pointer.y);
});
canvas.addEventListener("pointermove", (event) => {
  place(event);
  if (pointer.turning && event.buttons) eyes?.drag(event.movementX / canvas.clientHeight, event.movementY / canvas.clientHeight);
});
for (const kind of ["pointerup", "pointercancel"])
  canvas.addEventListener(kind, () => {
    hand?.release();
    pointer.turning = false;
  });
canvas.addEventListener("wheel", (event) => {
  event.preventDefault();
  hand?.wheel(Math.sign(event.deltaY));
}, { passive: false });
canvas.addEventListener("contextmenu", (event) => event.preventDefault());
canvas.addEventListener("webglcontextlost", (event) => event.preventDefault());
addEventListener("blur", () => hand?.release());
document.addEventListener("keydown", (event) => {
  if (!person || event.repeat && gestures.has(event.key) || event.ctrlKey || event.metaKey || event.altKey) return;
  if (gestures.press(event.key) || eyes?.key(event.key)) event.preventDefault();
});

/** Draw, and again; where pictures take long, a browser without a graphics card is left half of its time for what is to be sent. */
function draw(now: number): void {
  eyes?.step();
  room?.draw(now);
  labels?.draw(invited?.participant ?? "");
  const took = performance.now() - askedAt;
  if (took > SLOW_MS) setTimeout(ask, Math.min(took, MOST_REST_MS));
  else ask();
}

function ask(): void {
  askedAt = performance.now();
  requestAnimationFrame(draw);
}

const link = new Link(
  `${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/guest`,
  { words: hear, frame: see, trouble: say },
  JSON.stringify({ token }),
);
if (!token) say("This address has no invitation in it. Open the whole link that the host has sent you.", true);
if (!room) say("This browser has no WebGL 2, without which there is no picture of the room.", true);
else {
  ask();
  setInterval(tell, SEND_MS);
  window.guest = {
    me: () => (invited && room.figures.get(invited.participant)?.root.visible ? invited.participant : null),
    joints: (name) => room.figures.get(name)?.places() ?? [],
    thing: (id) => room.things.get(id)?.node.position.toArray() ?? null,
    seen: (at) => {
      const p = new Vector3(...at).project(room.camera);
      return [((p.x + 1) / 2) * canvas.clientWidth, ((1 - p.y) / 2) * canvas.clientHeight];
    },
    held: () => room.held.grasps,
    own: () => Boolean(invited && room.figures.get(invited.participant)?.own),
    ready: () => [...room.figures.values()].filter((f) => f.own).length,
    sent: () => sent,
    sharp: () => room.sharp(),
  };
}
document.documentElement.dataset.begun = "true"; // missing.js says what is wrong where this does not come
