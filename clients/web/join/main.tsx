// The page of a guest: whoever has the link chooses a person, enters, and is in the room, led by mouse, keys, camera or headset.
import { refusal } from "../connection/refusals";
import { render } from "preact";
import { Vector3 } from "three";
import { Link } from "../connection/link";
import { translated } from "../connection/trouble_words";
import { Lines } from "../console/chat";
import { Labels } from "../console/labels";
import { switchLanguage } from "../console/language";
import { Pictures } from "../console/pictures";
import { Room } from "../console/room";
import { type Caption, decode, type Frame, type Invited, type Joints, type Line, type Table, type Words } from "../console/wire";
import { Microphone } from "../sound/microphone";
import { canHear, Voices } from "../sound/voices";
import { Asks } from "./asks";
import { Camera } from "./camera";
import { Closer } from "./closer";
import { Eyes } from "./eyes";
import { GESTURES, Gestures } from "./gestures";
import { Hand } from "./hand";
import { Headset, HeadsetButton } from "./headset";
import { Menu } from "./menu";
import { CameraButton, drawMirror, Mirror } from "./mirror";
import { NoteChoice, NoteForm, Noting } from "./noting";
import { record } from "./record";
import { ShareButtons, ShareChoices, Sharing } from "./sharing";
import { ShowButtons, ShowChoice, Showing } from "./showing";
import { SignalButtons, Signalling } from "./signalling";
import { Wand, WandButton } from "./wand";
import { text } from "./words";
import { BoardChoice, WriteButtons, Writing } from "./writing";

const SEND_MS = 1000 / 30;
const MOST_LETTERS = 300; // of a line of the chat
const STILL_MS = 3000; // without a move of the pointer for so long, the head turns to who speaks
const MIRROR_MS = 500; // how often the words beside the mirror are looked after
const SLOW_MS = 60; // from asking for a picture until it is drawn
const MOST_REST_MS = 300;
const FOLLOWS = 0.45; // share of where the pointer is in the picture by which the head turns to it
const HIGH = 0.5; // of the picture, from the middle to its edge, in units of its height

const element = <T extends HTMLElement>(id: string) => document.getElementById(id) as T;
const canvas = element<HTMLCanvasElement>("room");
const trouble = element("trouble");
const token = location.hash.slice(1);
const room = opened();
const restMs = (took: number) => (took > SLOW_MS ? Math.min(took, MOST_REST_MS) : 0);
const pictures = room && new Pictures(canvas, () => room.ready, (now) => draw(room, now), restMs);
if (room) room.changed = () => pictures?.ask();
const labels = room && new Labels(room, element("labels"));
const closer = room && new Closer(room);
const gestures = new Gestures();
let joints: Joints | null = null;
let table: Table | null = null;
let invited: Invited | null = null;
let eyes: Eyes | null = null;
let hand: Hand | null = null;
let writing: Writing | null = null;
let person = ""; // as whom the guest has entered
let muted = false; // by the host
let sent = 0;
let movedAt = 0;
const pointer = { x: 0, y: 0, turning: false }; // where it is in the picture (-1 to 1, up)
let speaker = "";
let lines: Line[] = [];
const written: Record<"chat" | "private", Line[]> = { chat: [], private: [] };
let captions: Caption[] = [];
let to = ""; // the participant to whom alone the next line goes; empty: to all
let read = 0; // lines that have been seen: when the newest of them was written [ms]
let chatOpen = false;
const voices = new Voices(room, () => link, (hear) => person && link.send(JSON.stringify({ hear })));
const microphone = new Microphone(() => link, () => Boolean(person), () => showWords());
const camera = new Camera(() => link, () => Boolean(person), () => showMirror());
const headset = new Headset(room, () => link, () => eyes, () => lines, () => captions, drawWorn, () => person && showDoes(), () => (eyes?.open(), pictures?.ask()));
const wand = new Wand(() => link, () => eyes, () => person && showDoes(), (yaw, pitch) => eyes && ([eyes.yaw, eyes.pitch] = [yaw, pitch], pictures?.ask()));
const asks = new Asks((text) => link.send(text));
const signalling = new Signalling(
  () => Boolean(room?.signals.raised.some(([who]) => who === invited?.participant)),
  (said) => asks.ask(said),
);
const noting = new Noting((said) => asks.ask(said), () => (showDoes(), noting.open || canvas.focus()));
const showing = new Showing(token, (said) => asks.ask(said), () => person && showDoes());
const sharing = new Sharing(token, () => invited, (said) => link.send(JSON.stringify(said)), () => person && showDoes());
const meter = document.createElement("meter");

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
    say(refusal(words.why, words.values, words.reason), true);
  } else if (words.kind === "numbers") {
    const now = words.people.some((p) => p.muted && p.name === invited?.participant);
    if (now !== muted) {
      muted = now;
      showWords();
    }
  } else if (words.kind === "heard") {
    asks.hear(words.n);
  } else if (words.kind === "shown") {
    if (words.live) sharing.hear(words);
    else showing.hear(words);
    if (!words.done) room?.written.forgetDrafts();
  } else if (words.kind === "chat" || words.kind === "private") {
    written[words.kind] = words.lines;
    lines = [...written.chat, ...written.private].sort((a, b) => a.ms - b.ms);
    headset.hear();
    showWords();
  } else if (words.kind === "captions") {
    captions = words.captions;
    headset.hear();
    showCaptions();
  } else if (words.kind === "signals" && room) {
    room.signals = words;
    if (person) showDoes();
  } else if (words.kind === "invited") {
    invited = words;
    if (room && !eyes) {
      eyes = new Eyes(room, words.participant, words.seat);
      hand = new Hand(room, eyes, words.participant);
      writing = new Writing(room, words.participant, (said) => asks.ask(said));
      pictures?.ask();
    }
    if (person) {
      link.send(JSON.stringify({ person })); // after a break of the connection
      voices.again();
      sharing.again();
      if (!asks.again()) room?.written.forgetDrafts();
    }
    showWords();
  } else if (words.kind === "joints") {
    joints = words;
    room?.begin(words);
  } else if (words.kind === "table") {
    table = words;
    room?.receiveTable(words);
    sharing.see(words);
    if (person) showWords(); // who may be written to is another
  } else if (words.kind === "skin") {
    room?.receiveSkin(words);
  } else if (words.kind === "dents") {
    room?.dents.receive(words);
  } else if (words.kind === "ink") {
    room?.receiveInk(words);
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

function say(what: string | null, over = false): void {
  trouble.hidden = what === null;
  trouble.textContent = translated(what);
  if (!over) return;
  element("door").hidden = element("does").hidden = element("mirror").hidden = true;
  camera.close();
  headset.close();
  wand.close();
}

/** All that is written on the page now. */
function showWords(): void {
  showChat();
  if (person) showDoes();
  else if (invited) showDoor(invited);
}

/** Before the room: as whom to enter. */
function showDoor(words: Invited): void {
  const own = /person=(\w+)/.exec(words.avatar)?.[1] ?? "";
  const enter = (chosen: string) => {
    person = chosen;
    link.send(JSON.stringify({ person }));
    microphone.tell();
    void voices.turn(true).then(showDoes);
    element("door").hidden = true;
    element("does").hidden = false;
    showMirror();
    showDoes();
    canvas.focus();
  };
  const called = (name: string) => name[0]!.toUpperCase() + name.slice(1);
  render(
    <>
      <button type="button" class="language" onClick={() => (switchLanguage(), showWords())}>{text("other")}</button>
      <h2>{text("welcome", words.name)}</h2>
      <p>{text("choose")}</p>
      <div class="people">
        {words.people.map((name) => (
          <button type="button" key={name} aria-current={name === own} onClick={() => enter(name)}>
            {called(name)}
          </button>
        ))}
      </div>
      {own && <p class="faint">{text("ready", called(own))}</p>}
      <div class="sound">
        <MicrophoneButton />
        {microphone.state === "on" && <span class="faint">{text("test")}</span>}
      </div>
    </>,
    element("door"),
  );
  element("door").hidden = false;
}

/** The microphone's state, which is also the button that changes it, and how loud it is. */
function MicrophoneButton() {
  const { state } = microphone;
  const turn = () => void (state === "on" ? microphone.mute() : microphone.open());
  return (
    <>
      <button type="button" id="microphone" aria-pressed={state === "on"} disabled={state === "asking"} onClick={turn}>
        {text(`mic_${state}`)}
      </button>
      {muted && state === "on" && <span role="status">{text("muted")}</span>}
      {state === "on" && <span ref={(at) => at?.append(meter)} />}
    </>
  );
}

/** What was said to the room, and what it answered. */
function showCaptions(): void {
  const box = element("captions");
  box.hidden = captions.length === 0 || !person;
  const rows = captions.map(({ who, text: said, mark, reply }, n) => (
    <li key={n}>
      <b>{who}:</b> {said} {mark} {reply}
    </li>
  ));
  render(rows, box);
}

/** What people write, and a place to write in, to all or to one, once it is opened. */
function showChat(): void {
  if (chatOpen) read = Math.max(read, ...lines.map((line) => line.ms));
  const box = element("chat");
  box.hidden = !chatOpen || !person;
  const write = (event: Event) => {
    event.preventDefault();
    const input = (event.target as HTMLFormElement).elements.namedItem("line") as HTMLInputElement;
    const written = input.value.trim();
    if (!written || !trouble.hidden) return; // it stays there until there is a connection again
    asks.ask({ write: written, to });
    input.value = "";
  };
  const others = (table?.people ?? []).filter((p) => p.name !== invited?.participant);
  const named = (name: string) => (name === invited?.participant ? invited.name : (others.find((p) => p.name === name)?.shown ?? name));
  const readers = others.map((p) => p.name);
  if (to && !readers.includes(to)) readers.push(to); // who has just left is still the one who is meant: nobody else gets the line
  const hint = to ? text("write_to", named(to)) : text("write");
  const close = (event: KeyboardEvent) => {
    event.stopPropagation(); // letters are gestures elsewhere
    if (event.key === "Escape") turnChat();
  };
  render(
    <>
      {chatOpen && lines.length > 0 && (
        <Lines lines={lines} people={table?.people ?? []} label={text("chat")} alone={(name) => text("alone", name)} />
      )}
      {lines.length === 0 && <p>{text("noLines")}</p>}
      <form onSubmit={write} onKeyDown={close} class={to && "alone"}>
        <select aria-label={text("to")} value={to} onChange={(event) => ((to = event.currentTarget.value), showChat())}>
          <option value="">{text("to_all")}</option>
          {readers.map((name) => (
            <option key={name} value={name}>{text("to_one", named(name))}</option>
          ))}
        </select>
        <input name="line" type="text" maxLength={MOST_LETTERS} autocomplete="off" aria-label={hint} placeholder={hint} />
        <button type="submit">{text("send")}</button>
      </form>
    </>,
    box,
  );
}

function turnChat(): void {
  chatOpen = !chatOpen;
  showWords();
  if (chatOpen) element("chat").querySelector("input")?.focus();
  else canvas.focus();
}

function showDoes(): void {
  const unread = lines.filter((line) => line.ms > read && line.who !== invited?.participant).length;
  const turn = () => {
    void voices.turn(!voices.on).then(showDoes);
  };
  render(
    <>
      <MicrophoneButton />
      <CameraButton camera={camera} />
      <HeadsetButton headset={headset} />
      <WandButton wand={wand} />
      <button type="button" id="sound" aria-pressed={voices.on} disabled={!canHear} onClick={turn}>
        {text(canHear ? (voices.on ? "soundOn" : "soundOff") : "cannotHear")}
      </button>
      {voices.on && (
        <input type="range" aria-label={text("volume")} min={0} max={1.5} step={0.05} value={voices.volume}
          onInput={(event) => (voices.volume = Number(event.currentTarget.value))} />
      )}
      <button type="button" id="chat-button" aria-pressed={chatOpen} aria-controls="chat" onClick={turnChat}>
        {text("chat")} {unread > 0 && <b aria-label={text("unread", `${unread}`)}>{unread}</b>}
      </button>
      <Menu id="add" label={text("add")}>
        <ShowChoice showing={showing} />
        <ShareChoices sharing={sharing} />
        {writing && <BoardChoice writing={writing} />}
        <NoteChoice noting={noting} />
      </Menu>
      <ShowButtons showing={showing} />
      <ShareButtons sharing={sharing} />
      {writing && <WriteButtons writing={writing} changed={showDoes} />}
      <NoteForm noting={noting} />
      <SignalButtons signalling={signalling} />
      <Menu id="gestures" label={text("gestures")}>
        {GESTURES.map(({ name, key }, n) => (
          <button type="button" key={name} onClick={() => gestures.make(n + 1)}>
            {text(name)} <kbd>{key}</kbd>
          </button>
        ))}
      </Menu>
      <Menu id="help" label={text("help")}>
        <p>{text(wand.on ? "wand_hold" : "hold")}</p>
        <p>{text("closer")}</p>
      </Menu>
    </>,
    element("does"),
  );
}

/** What the camera sees, and the button that turns it on. */
function showMirror(): void {
  if (!person) return;
  showDoes();
  const on = camera.state === "on" || camera.state === "loading";
  if (on) pictures?.ask();
  element("mirror").hidden = !on;
  render(on ? <Mirror camera={camera} /> : null, element("mirror"));
}

/** What the guest does now, thirty times a second; nothing while the page is in the background, where the figure rests. */
function tell(): void {
  writing?.step();
  asks.step();
  if (!person || !eyes || !hand || document.hidden) return;
  let [yaw, pitch] = [eyes.yaw - pointer.x * FOLLOWS * canvas.clientWidth * HIGH / canvas.clientHeight, eyes.pitch + pointer.y * FOLLOWS * HIGH];
  const speaks = room?.figures.get(speaker);
  const reads = closer?.at;
  if (reads) [yaw, pitch] = eyes.towards(reads);
  else if (speaks && performance.now() - movedAt > STILL_MS) [yaw, pitch] = eyes.towards(speaks.joint("head").getWorldPosition(new Vector3()));
  const doing = { yaw, pitch, ...hand.led(pointer.x, pointer.y), ...gestures.newest };
  const data = record(doing);
  sent += data.byteLength;
  link.send(data);
}

function place(event: MouseEvent): void {
  const box = canvas.getBoundingClientRect();
  pointer.x = ((event.clientX - box.x) / box.width) * 2 - 1;
  pointer.y = 1 - ((event.clientY - box.y) / box.height) * 2;
  movedAt = performance.now();
}

canvas.addEventListener("pointerdown", (event) => {
  if (!person || !eyes || !hand) return;
  canvas.setPointerCapture(event.pointerId);
  place(event);
  if (wand.on) return wand.press(pointer.y / 2);
  if (event.button === 0 && writing?.press(pointer.x, pointer.y)) return;
  if (closer?.at) return; // no hand reaches from there
  pointer.turning = event.button !== 0 || !hand.press(pointer.x, pointer.y);
});
canvas.addEventListener("pointermove", (event) => {
  for (const between of event.getCoalescedEvents()) {
    place(between);
    writing?.move(pointer.x, pointer.y);
  }
  place(event);
  wand.slide(pointer.y / 2);
  writing?.move(pointer.x, pointer.y);
  if (!pointer.turning || !event.buttons) return;
  eyes?.drag(event.movementX / canvas.clientHeight, event.movementY / canvas.clientHeight);
  pictures?.ask();
});
for (const kind of ["pointerup", "pointercancel"])
  canvas.addEventListener(kind, () => {
    hand?.release();
    wand.release();
    writing?.release();
    pointer.turning = false;
  });
canvas.addEventListener("dblclick", (event) => {
  place(event);
  if (!person || writing?.tool || !closer?.turn(pointer.x, pointer.y)) return;
  hand?.release();
  pictures?.ask();
});
canvas.addEventListener("wheel", (event) => {
  event.preventDefault();
  hand?.wheel(Math.sign(event.deltaY));
}, { passive: false });
canvas.addEventListener("contextmenu", (event) => event.preventDefault());
addEventListener("blur", () => (hand?.release(), writing?.release()));
document.addEventListener("keydown", (event) => {
  if (!person || event.repeat && (gestures.has(event.key) || event.key.toUpperCase() === "R") || event.ctrlKey || event.metaKey || event.altKey) return;
  if (closer?.press(event.key) || noting.press(event.key) || signalling.press(event.key) || gestures.press(event.key) || eyes?.key(event.key)) event.preventDefault();
  pictures?.ask();
});

/** Draw the page's picture. Whether it will soon be another. */
function draw(room: Room, now: number): boolean {
  if (headset.on) return false; // that asks for its own pictures
  room.step(now);
  eyes?.step();
  closer?.step(room.camera);
  voices.step();
  const moves = room.draw(now);
  labels?.draw(invited?.participant ?? "");
  if (camera.state === "on") drawMirror(camera);
  return moves || camera.state === "on";
}

/** Draw a headset's picture. */
function drawWorn(now: number): void {
  room?.step(now);
  voices.step();
  room?.draw(now);
}

const link = new Link(
  `${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/guest`,
  {
    words: hear,
    frame: see,
    screen: (data) => room?.screens.receive(data),
    trouble: say,
    talker: (name, port) => voices.talker(name, port),
    silent: (name) => voices.silent(name),
    spoken: (level, bytes) => {
      Object.assign(microphone, { level, sent: bytes });
      meter.value = Math.min(1, 4 * level);
    },
    speechless: () => microphone.lose("cannot"),
  },
  JSON.stringify({ token, page: crypto.getRandomValues(new Uint32Array(3)).join(" ") }),
);
if (!token) say(text("noInvitation"), true);
if (!room) say(text("noPicture"), true);
else {
  setInterval(tell, SEND_MS);
  setInterval(() => camera.state === "on" && showMirror(), MIRROR_MS);
  window.guest = {
    me: () => (invited && room.figures.get(invited.participant)?.root.visible ? invited.participant : null),
    joints: (name) => room.figures.get(name)?.places() ?? [],
    thing: (id) => room.things.get(id)?.node.position.toArray() ?? null,
    seen: (at) => {
      const p = new Vector3(...at).project(room.camera);
      const { x, y, width, height } = canvas.getBoundingClientRect();
      return [x + ((p.x + 1) / 2) * width, y + ((1 - p.y) / 2) * height];
    },
    held: () => room.held.grasps,
    own: () => Boolean(invited && room.figures.get(invited.participant)?.own),
    ready: () => [...room.figures.values()].filter((f) => f.own).length,
    sent: () => sent + microphone.sent + camera.sent + headset.sent + wand.sent,
    sharp: () => room.sharp(),
    voices,
    microphone,
    camera,
    headset,
    wand,
    sharing,
    screens: (participant) => room.screens.drawn(participant),
  };
}
meter.setAttribute("aria-label", text("level"));
document.documentElement.dataset.begun = "true"; // missing.js says what is wrong where this does not come
