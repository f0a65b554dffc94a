// Sticky notes: a guest types what stands on one, and it lies before them.
import { text } from "./words";

const MOST_TEXT = 120; // letters, as vistel/space/notes/note.py has it
const KEY = "M";

export class Noting {
  open = false;

  constructor(
    private readonly say: (said: { note: string }) => void,
    private readonly changed: () => void,
  ) {}

  turn(): void {
    this.open = !this.open;
    this.changed();
  }

  /** Whether a key opened the line for the text. */
  press(key: string): boolean {
    if (key.toUpperCase() !== KEY) return false;
    if (!this.open) this.turn();
    return true;
  }

  write(note: string): void {
    if (note) this.say({ note });
    this.turn();
  }
}

const focus = (at: HTMLInputElement | null) => at?.focus();

export function NoteChoice({ noting }: { noting: Noting }) {
  return (
    <button type="button" id="new-note" aria-pressed={noting.open} onClick={() => noting.turn()}>
      {text("new_note")} <kbd>{KEY}</kbd>
    </button>
  );
}

/** Where the text of a note is typed, while one is. */
export function NoteForm({ noting }: { noting: Noting }) {
  const write = (event: Event) => {
    event.preventDefault();
    const input = (event.target as HTMLFormElement).elements.namedItem("note") as HTMLInputElement;
    noting.write(input.value.trim());
  };
  const close = (event: KeyboardEvent) => {
    event.stopPropagation(); // letters are gestures elsewhere
    if (event.key === "Escape") noting.turn();
  };
  if (!noting.open) return null;
  return (
    <form id="note" onSubmit={write} onKeyDown={close}>
      <input name="note" type="text" maxLength={MOST_TEXT} autocomplete="off" aria-label={text("note_text")}
        placeholder={text("note_text")} ref={focus} />
      <button type="submit">{text("note_write")}</button>
    </form>
  );
}
