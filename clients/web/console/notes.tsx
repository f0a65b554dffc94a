// Notes: what somebody wants to find again in a log; a list to go to, and a line to add one.
import { render } from "preact";
import { clockText } from "./lanes";
import { text } from "./words";
import type { Note } from "./wire";

const STORED = "vistel-author";
const LETTERS = 500; // vistel/log/notes.py
const AUTHOR_LETTERS = 40;

export class Notes {
  private notes: Note[] = [];
  private said = "";
  private written = "";
  private sent = ""; // and not known to be kept

  /** add: a note about now, or about the moment of the log; goTo: null where the room is live. */
  constructor(
    private readonly parent: HTMLElement,
    private readonly add: (text: string, author: string) => void,
    private goTo: ((t: number) => void) | null = null,
  ) {}

  begin(goTo: ((t: number) => void) | null): void {
    this.goTo = goTo;
    this.notes = [];
    this.said = "";
    this.show();
  }

  receive(notes: Note[], faults: string[]): void {
    this.notes = notes;
    if (notes.some((note) => note.text === this.sent)) this.forget();
    this.say(faults.join(" · "));
  }

  /** The note that was written is kept. */
  kept(said: string): void {
    this.forget();
    this.say(said);
  }

  private forget(): void {
    if (lineOf(this.written) === this.sent) this.written = "";
    this.sent = "";
  }

  /** What has become of a note. */
  say(said: string): void {
    this.said = said;
    this.show();
  }

  private submit(event: SubmitEvent): void {
    event.preventDefault();
    const author = (event.currentTarget as HTMLFormElement).querySelector<HTMLInputElement>("[name=author]")!.value;
    this.sent = lineOf(this.written);
    if (this.sent) this.add(this.written, author); // it stays there until it is kept
  }

  private show(): void {
    render(
      <section>
        <h2>{text("notesTitle")}</h2>
        <form class="note" onSubmit={(event) => this.submit(event)}>
          <input name="note" required maxLength={LETTERS} aria-label={text("note")} placeholder={text(this.goTo ? "noteHere" : "noteNow")} value={this.written}
            onInput={(event) => (this.written = event.currentTarget.value)} />
          <input name="author" maxLength={AUTHOR_LETTERS} aria-label={text("author")} placeholder={text("author")} defaultValue={localStorage.getItem(STORED) ?? ""}
            onInput={(event) => localStorage.setItem(STORED, event.currentTarget.value)} />
          <button type="submit">{text("addNote")}</button>
        </form>
        <p class="noted" role="status">{this.said}</p>
        {this.notes.length > 0 && (
          <ol class="notes">
            {this.notes.map((note, n) => (
              <li key={n}>
                <button type="button" onClick={() => this.goTo?.(note.t)}>
                  <time>{clockText(note.t)}</time>
                  <span>{note.text}</span>
                  {note.author && <small>{note.author}</small>}
                </button>
              </li>
            ))}
          </ol>
        )}
      </section>,
      this.parent,
    );
  }
}

/** As a note keeps what was written. */
function lineOf(written: string): string {
  return written.trim().replace(/\s+/g, " ");
}
