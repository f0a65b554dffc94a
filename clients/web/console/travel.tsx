// The live room or a log of it: which of the two is seen, and how one gets from one to the other.
import { refusal } from "../connection/refusals";
import { render } from "preact";
import { Link, type Listener } from "../connection/link";
import type { Lanes, Playhead } from "./lanes";
import { Notes } from "./notes";
import { Plots } from "./plots";
import { type Asked, Timeline } from "./timeline";
import { text } from "./words";
import type { Fields, Hello, Noted, Notes as NotesSaid, Plot, Refused } from "./wire";
import { Zoom } from "./zoom";

const BACK_S = 30;

export class Travel {
  link: Link;
  private readonly section = document.getElementById("timeline")!;
  private readonly zoom = new Zoom(() => {
    this.timeline.show();
    this.plots.zoomed();
  });
  private readonly timeline: Timeline;
  private readonly plots: Plots;
  private readonly notes = new Notes(document.getElementById("notes")!, (note, author) => this.send({ note, author }));
  private past = false; // of a room that goes on
  private ofLog = false;
  private beginAt: { back: number; playing: boolean } | null = null;

  private last: Playhead | null = null;

  /** sound: time of what is seen has leapt, or stands still, or goes on at its own speed (true); leap: it has leapt. */
  constructor(
    private readonly listener: Listener,
    private readonly sound: (sounding: boolean) => void,
    private readonly leap: () => void,
  ) {
    const remember = () => this.remember();
    const send = (asked: Asked) => this.send(asked);
    this.timeline = new Timeline(document.getElementById("lanes")!, this.zoom, send, remember, () => this.plots.chosen);
    this.plots = new Plots(document.getElementById("plots")!, this.zoom, send, (t) => this.timeline.goTo(t), remember);
    this.link = this.open("live");
    window.vistelTravel = {
      t: () => this.timeline.t,
      scrubMs: () => this.timeline.scrubMs,
      goTo: (t) => this.timeline.goTo(t),
      seen: () => [this.zoom.from, this.zoom.to],
      curves: () => this.plots.curves,
    };
  }

  hello(words: Hello): void {
    this.ofLog = Boolean(words.log);
    this.last = null;
    this.sound(!this.ofLog);
    this.leap();
    document.body.classList.toggle("past", this.ofLog);
    this.section.hidden = !this.ofLog;
    if (words.log) {
      this.timeline.begin(words, this.past ? () => this.live() : null);
      const named = this.plots.chosen.length ? [...this.plots.chosen] : inAddress().getAll("plot");
      this.plots.begin(named, Boolean(words.beside));
    } else this.timeline.end();
    document.getElementById("notes")!.hidden = !words.log && !words.steers;
    this.notes.begin(words.log ? (t) => this.timeline.goTo(t) : null);
    this.offer(Boolean(words.recorded));
  }

  /** Whether a log is seen. */
  get seesLog(): boolean {
    return this.ofLog;
  }

  /** Whether the page hears voices now; on: whether somebody wants to. */
  wantVoices(hears: boolean, on: boolean): void {
    this.timeline.sound = on;
    if (this.ofLog) this.send({ hears });
    else this.link.send(hears ? "hear" : "quiet");
  }

  /** Voices go on only where time does, at its own speed. */
  private listen(head: Playhead): void {
    const sounds = (h: Playhead | null) => Boolean(h?.playing && h.speed === 1);
    const { last } = this;
    const leapt = head.leaps !== last?.leaps;
    if (sounds(head) !== sounds(last) || (sounds(head) && leapt)) this.sound(sounds(head));
    if (leapt) this.leap();
    this.last = head;
  }

  hear(words: Playhead | Lanes | Plot | Fields | NotesSaid | Noted | Refused): void {
    if (words.kind === "lanes") return this.timeline.receiveLanes(words);
    if (words.kind === "plot" || words.kind === "fields") return this.plots.receive(words);
    if (words.kind === "noted") return this.notes.kept(text("noted", words.text));
    if (words.kind === "refused") return this.notes.say(refusal(words.why, words.values, words.reason));
    if (words.kind === "notes") {
      this.timeline.receiveNotes(words.notes);
      return this.notes.receive(words.notes, words.faults);
    }
    if (this.beginAt) {
      const { back, playing } = this.beginAt;
      this.beginAt = null;
      this.timeline.ask({ t: Math.max(0, words.end - back), playing });
    }
    this.listen(words);
    this.timeline.receiveHead(words);
    this.plots.move(this.timeline.t, words.end);
  }

  private send(asked: Asked): void {
    this.link.send(JSON.stringify(asked));
    if (asked.offset !== undefined) this.plots.zoomed(); // they are other ones now
  }

  /** The moment and the plots, in the address of a log. */
  private remember(): void {
    if (this.past || !this.ofLog) return;
    const named = this.plots.chosen.map((name) => `&plot=${encodeURIComponent(name)}`).join("");
    history.replaceState(null, "", `#t=${this.timeline.t.toFixed(2)}${named}`);
  }

  private offer(recorded: boolean): void {
    const buttons: [string, number, boolean][] = recorded ? [[text("goBack"), 0, false], [text("goBack30"), BACK_S, true]] : [];
    render(
      <>
        {buttons.map(([said, back, playing]) => (
          <button type="button" key={said} onClick={() => this.goBack(back, playing)}>
            {said}
          </button>
        ))}
      </>,
      document.getElementById("past")!,
    );
  }

  private goBack(back: number, playing: boolean): void {
    this.past = true;
    this.beginAt = { back, playing };
    this.link.close();
    this.link = this.open("past");
  }

  private live(): void {
    this.past = false;
    this.link.close();
    this.link = this.open("live");
  }

  private open(path: "live" | "past"): Link {
    return new Link(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/${path}`, this.listener);
  }
}

function inAddress(): URLSearchParams {
  return new URLSearchParams(location.hash.slice(1));
}
