// The host steers the conference: a line for the world, and what else they can do; each action with its answer. Shown to hosts alone.
import { type ComponentChildren, render } from "preact";
import { refusal } from "../../connection/refusals";
import type { Completions, LogLines, Steered, Steering } from "../wire";
import { AskLine } from "./ask";
import { Confirm, type Question } from "./confirm";
import { type Action, deed, Faults, People, Processes, Recording, Worlds } from "./groups";
import { type Filter, Lines } from "./lines";
import { said } from "./words";

const KEPT = 6;
const AUTHOR = "vistel-author"; // as notes keep it

interface Answer {
  id: number;
  action: Action;
  text: string;
  done?: boolean;
  answer: string;
}

export class SteeringPanel {
  private steers = false;
  private state: Steering | null = null;
  private completions: Completions | null = null;
  private lines: LogLines["lines"] = [];
  private filter: Filter | null = null;
  private answers: Answer[] = [];
  private readonly links = new Map<string, string>();
  private question: Question | null = null;
  private things: readonly string[] = [];
  private last = Date.now() % 1e9; // so that answers to a page before are not taken for this one's

  constructor(
    private readonly parent: HTMLElement,
    private readonly send: (said: object) => void,
  ) {}

  /** The connection is there, or there again: what was not answered before is not answered any more. */
  begin(steers: boolean): void {
    this.steers = steers;
    this.answers = this.answers.map((one) => (one.done === undefined ? { ...one, done: false, answer: said("broke") } : one));
    if (steers && this.filter) this.send({ lines: this.filter });
    this.show();
  }

  receive(words: Steering | Steered | Completions | LogLines): void {
    if (words.kind === "steering") {
      this.state = words;
      for (const guest of this.links.keys()) if (!words.people.some(({ invited }) => invited === guest)) this.links.delete(guest);
    } else if (words.kind === "completions") this.completions = words;
    else if (words.kind === "lines") this.lines = words.lines;
    else this.answer(words);
    this.show();
  }

  /** Names of what is in the room. */
  seeThings(names: readonly string[]): void {
    if (names.join() === this.things.join()) return;
    this.things = names;
    this.show();
  }

  private answer({ id, done, answer: english, token, why, values }: Steered): void {
    const answer = refusal(why, values, english);
    this.answers = this.answers.map((one) => (one.id === id ? { ...one, done, answer } : one));
    const asked = this.answers.find((one) => one.id === id);
    if (token && asked) {
      this.links.set(asked.text, `${location.origin}/join#${token}`);
      if (this.state) this.state.people.forEach((p) => answer.endsWith(` ${p.name}`) && (p.invited = asked.text));
    }
    if (done && asked?.action === "remove") this.free(asked.text);
  }

  /** The server tells only what differs from what it told before: nothing where a seat was given and taken between two of its looks. */
  private free(participant: string): void {
    for (const row of this.state?.people ?? []) {
      if (row.name !== participant) continue;
      this.links.delete(row.invited);
      row.invited = "";
    }
  }

  private readonly act = (action: Action, text: string, words: Record<string, string>): void => {
    const id = ++this.last;
    this.answers = [{ id, action, text, answer: "" }, ...this.answers].slice(0, KEPT);
    this.send({ do: action, id, by: localStorage.getItem(AUTHOR) ?? "", ...words });
    this.show();
  };

  private readonly confirm = (question: Question | null): void => {
    this.question = question;
    this.show();
  };

  private watch(filter: Filter | null): void {
    this.filter = filter;
    this.send({ lines: filter });
  }

  private show(): void {
    const { state, act, confirm, question } = this;
    render(
      this.steers && (
        <section class="steer">
          <h2>{said("title")}</h2>
          <AskLine things={this.things} completions={this.completions} complete={(complete) => this.send({ complete })} ask={(text) => act("ask", text, { text })} />
          <ol class="answers" role="log" aria-label={said("answers")}>
            {this.answers.map(({ id, action, text, done, answer }) => (
              <li key={id} class={done === false ? "bad" : ""}>
                <span>{deed(action, text)}</span> <i>{outcome(action, done, answer)}</i>
              </li>
            ))}
          </ol>
          {state && (
            <>
              {!state.runs && <p class="none">{said("noRun")}</p>}
              <Recording processes={state.processes} {...{ act, confirm }} />
              <Group name="people"><People people={state.people} links={this.links} {...{ act, confirm }} /></Group>
              {state.runs && <Group name="services"><Processes processes={state.processes} {...{ act, confirm }} /></Group>}
              {state.worlds.length > 1 && <Group name="worlds"><Worlds worlds={state.worlds} act={act} /></Group>}
              {state.faults.length > 0 && <Group name="faults"><Faults faults={state.faults} {...{ act, confirm }} /></Group>}
              <Group name="lines" toggled={(open) => this.watch(open ? { level: "", node: "", text: "" } : null)}>
                {this.filter && <Lines lines={this.lines} nodes={state.nodes} filter={(wanted) => this.watch(wanted)} />}
              </Group>
            </>
          )}
          {question && <Confirm question={question} close={() => confirm(null)} />}
        </section>
      ),
      this.parent,
    );
  }
}

function Group({ name, toggled, children }: { name: "people" | "services" | "worlds" | "faults" | "lines"; toggled?: (open: boolean) => void; children: ComponentChildren }) {
  return (
    <details class={`steer-${name}`} onToggle={(event) => toggled?.(event.currentTarget.open)}>
      <summary>{said(name)}</summary>
      {children}
    </details>
  );
}

function outcome(action: Action, done: boolean | undefined, answer: string): string {
  if (done === undefined) return said("waiting");
  if (!done) return answer;
  return action === "ask" && answer ? said("doneTo", answer) : said("done");
}
