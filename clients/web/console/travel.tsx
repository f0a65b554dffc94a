// The live room or a log of it: which of the two is seen, and how one gets from one to the other.
import { render } from "preact";
import { Link, type Listener } from "../connection/link";
import type { Lanes, Playhead } from "./lanes";
import { Timeline } from "./timeline";
import type { Hello } from "./wire";

const BACK_S = 30;

export class Travel {
  link: Link;
  private readonly timeline: Timeline;
  private past = false; // of a room that goes on
  private ofLog = false;
  private beginAt: { back: number; playing: boolean } | null = null;

  constructor(private readonly listener: Listener) {
    this.timeline = new Timeline(document.getElementById("timeline")!, (asked) => this.link.send(JSON.stringify(asked)));
    this.link = this.open("live");
    window.vistelTravel = { t: () => this.timeline.t, scrubMs: () => this.timeline.scrubMs, goTo: (t) => this.timeline.goTo(t) };
  }

  hello(words: Hello): void {
    this.ofLog = Boolean(words.log);
    document.body.classList.toggle("past", this.ofLog);
    if (words.log) this.timeline.begin(words.damage ?? [], words.grows ?? false, this.past ? () => this.live() : null);
    else this.timeline.end();
    this.offer(Boolean(words.recorded));
  }

  /** Whether the page hears the voices of the live room; a log has none yet. */
  wantVoices(hears: boolean): void {
    if (!this.ofLog) this.link.send(hears ? "hear" : "quiet");
  }

  hear(words: Playhead | Lanes): void {
    if (words.kind === "lanes") return this.timeline.receiveLanes(words);
    if (this.beginAt) {
      const { back, playing } = this.beginAt;
      this.beginAt = null;
      this.link.send(JSON.stringify({ t: Math.max(0, words.end - back), playing }));
    }
    this.timeline.receiveHead(words);
  }

  private offer(recorded: boolean): void {
    const buttons: [string, number, boolean][] = recorded ? [["Pause", 0, false], [`Back ${BACK_S} s`, BACK_S, true]] : [];
    render(
      <>
        {buttons.map(([text, back, playing]) => (
          <button type="button" key={text} onClick={() => this.goBack(back, playing)}>
            {text}
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
