// The console: the room live, and how the conference goes.
import { render } from "preact";
import { translated } from "../connection/trouble_words";
import { canHear, Voices } from "../sound/voices";
import { Lines } from "./chat";
import { EventList, Events } from "./events";
import { Goes, Troubles } from "./goes";
import { History } from "./history";
import { Labels } from "./labels";
import { switchLanguage } from "./language";
import { Looking } from "./looking";
import { FlowList, FlowMap } from "./map/map";
import { mapText } from "./map/words";
import { panelText } from "./panel_words";
import { Pictures } from "./pictures";
import { Room } from "./room";
import { SteeringPanel } from "./steering/panel";
import { Travel } from "./travel";
import { text } from "./words";
import {
  type Curve,
  decodeAll,
  type Force,
  type Heard,
  type Held,
  type Invited,
  type Joints,
  type Line,
  type Numbers,
  type Private,
  type Shown,
  type Signals,
  type Table,
  type Time,
  type Words,
} from "./wire";
import { type Chosen, Who } from "./who";

declare global {
  interface Window {
    /** For programs that drive the page. joints: places of somebody's joints in the room [m]; pressed, dented: of corners of their skin, of a thing; contacts: arrows and shapes at who is chosen; ghost: joints in the log beside; rate: pictures a second; ready: how many
     * have their own figures; drawn: pictures so far; screens: pictures of what somebody shows live that were decoded; sharp: see Room; pictures: whom to tell of every picture from now on, as Room.seen. */
    vistel?: {
      joints(name: string): [number, number, number][];
      ghost(name: string): [number, number, number][];
      contacts(): [arrows: number, shapes: number];
      pressed(name: string): [corner: number, x: number, y: number, z: number][];
      dented(thing: string): [corner: number, x: number, y: number, z: number][];
      rate(): number;
      ready(): number;
      drawn(): number;
      screens(participant: string): number;
      sharp(): void;
      pictures(tell: (tMs: number, atMs: number) => void): void;
      voices: Voices;
    };
    /** Where in a log the page is [s], how long the last scrub took from the hand's rest to its picture [ms], which part of the log is
     * seen [s], and what is plotted. */
    vistelTravel?: { t(): number; scrubMs(): number; goTo(t: number): void; seen(): [number, number]; curves(): readonly Curve[] };
  }
}

const PANEL_MS = 250;
const CLICK_PX = 5; // a press that moves farther turns the view
const element = <T extends HTMLElement>(id: string) => document.getElementById(id) as T;
const canvas = element<HTMLCanvasElement>("room");
const trouble = element("trouble");
const page: {
  table: Table | null;
  held: Held;
  forces: Force[];
  signals: Signals;
  numbers: Numbers | null;
  chosen: Chosen;
  talks: Set<string>;
  lines: Line[];
  map: boolean; // it is seen
} = {
  table: null,
  held: { kind: "held", grasps: [], touching: [] },
  forces: [],
  signals: { kind: "signals", raised: [], reactions: [] },
  numbers: null,
  chosen: null,
  talks: new Set(),
  lines: [],
  map: false,
};
const narrow = matchMedia("(max-width: 60rem)"); // as console.css has it
const history = new History();
const steering = new SteeringPanel(element("steering"), (said) => travel.link.send(JSON.stringify(said)));
const events = new Events();
let joints: Joints | null = null;
let view = "round";
let later = 0;
let shownAt = 0;
let room: Room | null = null;
try {
  room = new Room(canvas);
} catch {
  canvas.hidden = true;
  element("nopicture").hidden = false; // the tables go on
}
const looking = room && new Looking(room, (now) => showViews((view = now)));
const labels = room && new Labels(room, element("labels"));
const voices = new Voices(room, () => travel.link, (hears) => travel.wantVoices(hears, voices.on));

/** Soon: what changes with every frame is laid out a few times a second. */
function showSoon(): void {
  later ||= window.setTimeout(showPanel, Math.max(0, shownAt + PANEL_MS - performance.now()));
}

function choose(chosen: Chosen): void {
  page.chosen = chosen;
  if (room?.contacts.choose(chosen, room.figures)) room.change();
  showPanel();
}

function showPanel(): void {
  clearTimeout(later);
  later = 0;
  shownAt = performance.now();
  const { table, held, forces, signals, numbers, chosen, talks, lines } = page;
  render(
    <>
      {table && <Who people={table.people} things={table.things} {...{ held, forces, signals, numbers, talks, chosen, choose }} />}
      {lines.length > 0 && (
        <section>
          <h2>{panelText("chat")}</h2>
          <Lines lines={lines} people={table?.people ?? []} label={panelText("chatAbout")} />
        </section>
      )}
      <EventList events={events} />
      {numbers && (
        <>
          <p>
            <button type="button" aria-pressed={page.map} onClick={() => showMap(!page.map)}>{mapText("map")}</button>
          </p>
          {page.map && narrow.matches && <FlowList numbers={numbers} />}
          <Goes numbers={numbers} history={history} />
        </>
      )}
    </>,
    element("panel"),
  );
  const covered = page.map && !narrow.matches; // the map takes the place of the room
  element("map").hidden = !covered;
  canvas.hidden = covered || !room;
  render(covered && numbers && <FlowMap numbers={numbers} close={() => showMap(false)} />, element("map"));
  render(numbers && <Troubles numbers={numbers} />, element("troubles"));
}

function showMap(seen: boolean): void {
  page.map = seen;
  showPanel();
  showViews(view);
}

function showViews(now: string): void {
  const covered = page.map && !narrow.matches; // no view is seen
  const views = [["round", panelText("roomView")], ["table", panelText("tableView")], ...(page.table?.people ?? []).map((p) => [p.name, panelText("eyesOf", p.shown)])];
  render(
    <>
      {views.map(([name, text]) => (
        <button type="button" key={name} aria-pressed={name === now && !covered} onClick={() => (showMap(false), looking?.choose(name!))}>
          {text}
        </button>
      ))}
    </>,
    element("views"),
  );
}

function hear(words: Words): void {
  const live = travel.seesLog ? null : events; // what a log shows has not just happened
  if (words.kind === "hello") {
    document.title = `${words.log ?? words.conference} – VISTEL`;
    element("conference").textContent = words.log ?? words.conference;
    travel.hello(words);
    steering.begin(Boolean(words.steers));
    showStudio(words.studio ?? "");
    events.begin();
    if (!words.beside) room?.receiveBeside(null);
    showSound();
  } else if (words.kind === "joints") {
    joints = words;
    room?.begin(words);
  } else if (words.kind === "table") {
    page.table = words;
    steering.seeThings(words.things.map((thing) => thing.name));
    live?.receiveTable(words);
    room?.receiveTable(words);
    if (looking) showViews(view);
  } else if (words.kind === "ink") {
    room?.receiveInk(words);
  } else if (words.kind === "skin") {
    return room?.receiveSkin(words);
  } else if (words.kind === "dents") {
    return room?.dents.receive(words);
  } else if (words.kind === "forces") {
    page.forces = words.touches;
    room?.receiveForces(words);
  } else if (words.kind === "held") {
    page.held = words;
    live?.receiveHeld(words);
    if (room) room.held = words;
  } else if (words.kind === "signals") {
    page.signals = words;
    live?.receiveSignals(words);
    if (room) room.signals = words;
  } else if (words.kind === "chat") {
    page.lines = words.lines;
  } else if (words.kind === "numbers") {
    page.numbers = words;
    history.add(words);
    live?.receiveNumbers(words);
    const pictures = room ? panelText("picturesHere", room.picturesPerS.toFixed(0)) : panelText("tablesOnly");
    element("state").textContent = panelText("both", pictures, panelText(words.viewers === 1 ? "viewer" : "viewers", words.viewers));
  } else if (words.kind === "answers") {
    live?.receiveAnswers(words);
  } else if (words.kind === "steering" || words.kind === "steered" || words.kind === "completions" || words.kind === "lines") {
    return steering.receive(words);
  } else if (words.kind === "captions") {
    live?.receiveCaptions(words.captions);
  } else if (words.kind === "beside") {
    if (words.said.kind === "table") room?.receiveBeside(words.said);
  } else if (!isOfGuests(words)) {
    return travel.hear(words);
  }
  showSoon();
}

/** The way to the studios that run on this machine. address: "" for none. */
function showStudio(address: string): void {
  const link = element<HTMLAnchorElement>("studio");
  link.hidden = !address || !["localhost", "127.0.0.1"].includes(location.hostname);
  link.href = address;
  link.textContent = panelText("studio");
}

/** What is said to the pages of guests alone. */
function isOfGuests(words: Words): words is Invited | Heard | Shown | Time | Private {
  return ["invited", "heard", "shown", "time", "private"].includes(words.kind);
}

function see(data: ArrayBuffer): void {
  const [frame, beside] = joints ? decodeAll(data, joints) : [];
  if (!frame) return;
  room?.receiveFrame(frame);
  if (beside) room?.receiveBesideFrame(beside);
  const talks = new Set(frame.people.flatMap((p) => (p.talks ? [page.table?.people[p.who]?.name ?? ""] : [])));
  if (talks.size !== page.talks.size || [...talks].some((name) => !page.talks.has(name))) {
    page.talks = talks;
    showSoon();
  }
}

/** Browsers give sound where somebody has clicked. */
function showSound(): void {
  const turn = () => {
    void voices.turn(!voices.on);
    showSound();
  };
  const said = text(canHear ? (voices.on ? "soundOn" : travel.seesLog ? "hear_log" : "hear_live") : "cannotHear");
  render(
    <>
      <button type="button" aria-pressed={voices.on} disabled={!canHear} onClick={turn}>{said}</button>
      {voices.on && (
        <input type="range" aria-label={text("volume")} min={0} max={1.5} step={0.05} value={voices.volume}
          onInput={(event) => (voices.volume = Number(event.currentTarget.value))} />
      )}
    </>,
    element("sound"),
  );
}

/** text: why nothing comes; null: it does. */
function say(text: string | null): void {
  trouble.hidden = text === null;
  trouble.textContent = translated(text);
}

function draw(room: Room, now: number): boolean {
  room.step(now);
  looking?.step();
  voices.step();
  const moves = room.draw(now);
  labels?.draw(view);
  return moves;
}

let pressed: PointerEvent | null = null;
canvas.addEventListener("pointerdown", (event) => (pressed = event));
canvas.addEventListener("pointerup", (event) => {
  if (!pressed || Math.hypot(event.clientX - pressed.clientX, event.clientY - pressed.clientY) > CLICK_PX) return;
  const box = canvas.getBoundingClientRect();
  choose(room?.pick(((event.clientX - box.x) / box.width) * 2 - 1, 1 - ((event.clientY - box.y) / box.height) * 2) ?? null);
});

if (room) {
  const drawn = room;
  showViews(view);
  const pictures = new Pictures(canvas, () => drawn.ready, (now) => draw(drawn, now));
  drawn.changed = () => pictures.ask();
  window.vistel = {
    joints: (name) => drawn.figures.get(name)?.places() ?? [],
    ghost: (name) => drawn.ghosts.get(name)?.places() ?? [],
    contacts: () => drawn.contacts.count,
    pressed: (name) => drawn.figures.get(name)?.pressed() ?? [],
    dented: (thing) => drawn.dents.corners(thing),
    rate: () => drawn.picturesPerS,
    drawn: () => drawn.drawn,
    screens: (participant) => drawn.screens.drawn(participant),
    sharp: () => drawn.sharp(),
    ready: () => [...drawn.figures.values()].filter((f) => f.own).length,
    pictures: (tell) => {
      const { seen } = drawn;
      drawn.seenEveryMs = 0;
      drawn.seen = (tMs, atMs) => (seen?.(tMs, atMs), tell(tMs, atMs));
    },
    voices,
  };
}
const travel = new Travel(
  {
    words: hear,
    frame: see,
    screen: (data) => room?.screens.receive(data),
    trouble: say,
    talker: (name, port) => voices.talker(name, port),
    silent: (name) => voices.silent(name),
  },
  (sounding) => voices.leap(sounding),
  () => room?.screens.leap(),
);
narrow.addEventListener("change", () => showMap(page.map));
showSound();
trouble.textContent = panelText("waiting");
element("nopicture").textContent = panelText("noPicture");
for (const [id, key] of [["room", "roomLabel"], ["views", "viewsLabel"], ["past", "pastLabel"], ["timeline", "timelineLabel"]] as const) {
  element(id).setAttribute("aria-label", panelText(key));
}
element("language").textContent = text("language");
element("language").onclick = () => {
  switchLanguage();
  location.reload();
};
document.documentElement.dataset.begun = "true"; // missing.js says what is wrong where this does not come
