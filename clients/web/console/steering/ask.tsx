// A line for the world, as `vistel ask` takes it, with what can follow while it is typed.
import { useState } from "preact/hooks";
import type { Completions } from "../wire";
import { said } from "./words";

const SHOWN = 8;
const MOST_LETTERS = 200;

interface Props {
  things: readonly string[]; // names
  completions: Completions | null;
  complete(line: string): void;
  ask(line: string): void;
}

export function AskLine({ things, completions, complete, ask }: Props) {
  const [typed, setTyped] = useState("");
  const [open, setOpen] = useState(false);
  const [at, setAt] = useState(-1);
  const found = open && typed.trim() && completions?.line === typed ? offered(typed, completions, things) : [];
  const type = (line: string) => {
    setTyped(line);
    setAt(-1);
    setOpen(true);
    complete(line);
  };
  const take = ({ word, keep }: Offer) => type(`${typed.slice(0, keep)}${word} `);
  const key = (event: KeyboardEvent) => {
    const by = { ArrowDown: 1, ArrowUp: -1 }[event.key];
    if (by && found.length) {
      event.preventDefault();
      setAt(Math.min(found.length - 1, Math.max(-1, at + by)));
    } else if ((event.key === "Enter" || event.key === "Tab") && found[at]) {
      event.preventDefault();
      take(found[at]!);
    } else if (event.key === "Escape") setOpen(false);
  };
  const submit = (event: SubmitEvent) => {
    event.preventDefault();
    if (!typed.trim()) return;
    ask(typed.trim());
    setTyped("");
    setOpen(false);
  };
  return (
    <form class="ask" onSubmit={submit}>
      <div>
        <input
          name="ask"
          role="combobox"
          autocomplete="off"
          autocapitalize="off"
          spellcheck={false}
          maxLength={MOST_LETTERS}
          aria-label={said("ask")}
          aria-expanded={found.length > 0}
          aria-controls="ask-found"
          aria-autocomplete="list"
          aria-activedescendant={at >= 0 && found[at] ? `ask-${at}` : undefined}
          placeholder={said("askHint")}
          value={typed}
          onInput={(event) => type(event.currentTarget.value)}
          onKeyDown={key}
          onBlur={() => setOpen(false)}
        />
        <ul id="ask-found" role="listbox" aria-label={said("found")} hidden={!found.length}>
          {found.map((offer, n) => (
            <li key={offer.word} id={`ask-${n}`} role="option" aria-selected={n === at}
              onPointerDown={(event) => {
                event.preventDefault(); // the field keeps the keyboard
                take(offer);
              }}>
              {offer.word}
            </li>
          ))}
        </ul>
      </div>
      <button type="submit">{said("askIt")}</button>
    </form>
  );
}

interface Offer {
  word: string;
  keep: number; // letters of the line that stay before it
}

function offered(line: string, { words, thing }: Completions, things: readonly string[]): Offer[] {
  const keep = line.length - /\S*$/.exec(line)![0].length;
  const named = thing ? [...new Set(things)].flatMap((name) => asName(line, name, keep)) : [];
  const longest = Math.min(keep, ...named.map((offer) => offer.keep)); // whoever has typed "red b" does not mean the box
  return [...words.map((word) => ({ word, keep })), ...named.filter((offer) => offer.keep === longest)].slice(0, SHOWN);
}

/** The name of a thing, in place of as many words at the line's end as it begins with, or of its last one that begins one of its words. */
function asName(line: string, name: string, keep: number): Offer[] {
  const [typed, known] = [line.toLowerCase(), name.toLowerCase()];
  for (const { index } of typed.matchAll(/(?<=\s)\S/g)) if (known.startsWith(typed.slice(index))) return known === typed.slice(index) ? [] : [{ word: name, keep: index }];
  return known.split(" ").some((word) => word.startsWith(typed.slice(keep))) ? [{ word: name, keep }] : [];
}
