// What has happened in the room since the page was opened, the newest first: who came and went, what was taken and said, what broke.
import { panelText } from "./panel_words";
import type { Answers, Caption, Held, Numbers, Signals, Table } from "./wire";

const KEPT = 100;
const OVER_MS = 30e3; // a trouble that comes back sooner was not over

interface Event {
  at: Date;
  bad: boolean;
  say: () => string; // in the language of now
}

type Grasp = Held["grasps"][number];

export class Events {
  private readonly kept: Event[] = [];
  private table: Table | null = null;
  private held: Grasp[] = [];
  private raised: string[] | null = null;
  private states: Map<string, string> | null = null;
  private answered: Set<string> | null = null; // by participant and command
  private readonly troubles = new Map<string, number>(); // when each was last there
  private readonly heard = new Set<string>(); // captions that are still shown

  /** now: of the day. */
  constructor(private readonly now: () => Date = () => new Date()) {}

  /** Another room is seen: what is there at first has not just happened. */
  begin(): void {
    this.kept.length = this.held.length = 0;
    this.table = this.raised = this.states = this.answered = null;
    this.troubles.clear();
    this.heard.clear();
  }

  receiveTable(table: Table): void {
    const before = this.table;
    this.table = table;
    if (!before) return;
    const names = (of: Table) => new Map(of.people.map((p) => [p.name, p.shown]));
    const [were, are] = [names(before), names(table)];
    for (const [name, shown] of are) if (!were.has(name)) this.add(() => panelText("came", shown));
    for (const [name, shown] of were) if (!are.has(name)) this.add(() => panelText("went", shown));
  }

  receiveHeld({ grasps }: Held): void {
    const has = (all: Grasp[], one: Grasp) => all.some((other) => other.every((part, n) => part === one[n]));
    if (this.table) {
      for (const grasp of grasps) if (!has(this.held, grasp)) this.tellGrasp("takes", grasp);
      for (const grasp of this.held) if (!has(grasps, grasp)) this.tellGrasp("letsGo", grasp);
    }
    this.held = [...grasps];
  }

  receiveSignals({ raised }: Signals): void {
    const names = raised.map(([name]) => name);
    for (const name of this.raised ? names.filter((one) => !this.raised!.includes(one)) : []) this.add(() => panelText("raises", this.person(name)));
    this.raised = names;
  }

  receiveCaptions(captions: Caption[]): void {
    const keys = captions.map(({ who, text, reply }) => [who, text, reply].join("\n"));
    captions.forEach(({ who, text, reply }, n) => {
      if (!this.heard.has(keys[n]!)) this.add(() => panelText(reply ? "saidAndAnswered" : "said", who, text, reply));
    });
    this.heard.clear();
    for (const key of keys) this.heard.add(key);
  }

  receiveAnswers({ answers }: Answers): void {
    const known = this.answered;
    this.answered = new Set(answers.map(({ who, id }) => `${who} ${id}`));
    for (const { who, id, text, done, reason } of known ? answers : [])
      if (!known!.has(`${who} ${id}`)) this.add(() => panelText(done ? "done" : "refused", this.person(who), text, reason), !done);
  }

  receiveNumbers({ devices, troubles }: Numbers): void {
    const states = new Map(devices.map((d) => [d.name, d.state]));
    for (const { name, state, detail } of devices) {
      const before = this.states?.get(name);
      if (before === undefined || before === state || state === "absent") continue;
      const sends = state === "streaming";
      this.add(() => panelText(sends ? "deviceBack" : "deviceLost", name, detail || state), !sends);
    }
    this.states = states;
    const now = this.now().getTime();
    for (const line of troubles) {
      if (now - (this.troubles.get(line) ?? -Infinity) > OVER_MS) this.add(() => line, true);
      this.troubles.set(line, now);
    }
  }

  /** The newest first. */
  get lines(): readonly { at: Date; text: string; bad: boolean }[] {
    return this.kept.map(({ at, say, bad }) => ({ at, bad, text: say() })).reverse();
  }

  private person(name: string): string {
    return this.table?.people.find((p) => p.name === name)?.shown ?? name;
  }

  private tellGrasp(what: "takes" | "letsGo", [name, , id]: Grasp): void {
    const thing = this.table?.things.find((t) => t.id === id)?.name ?? id;
    const person = this.person(name);
    this.add(() => panelText(what, person, thing));
  }

  private add(say: () => string, bad = false): void {
    this.kept.push({ at: this.now(), bad, say });
    if (this.kept.length > KEPT) this.kept.shift();
  }
}

export function EventList({ events: { lines } }: { events: Events }) {
  if (!lines.length) return null;
  return (
    <section>
      <h2>{panelText("events")}</h2>
      <ol class="events" role="log" tabIndex={0} aria-label={panelText("events")}>
        {lines.map(({ at, text, bad }, n) => (
          <li key={lines.length - n} class={bad ? "bad" : ""}>
            <time>{at.toTimeString().slice(0, 8)}</time> {text}
          </li>
        ))}
      </ol>
    </section>
  );
}
