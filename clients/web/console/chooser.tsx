// Which number to plot: a field to type words into, and the numbers that have all of them in their names.
import { useEffect, useRef, useState } from "preact/hooks";
import { BESIDE, DIFFERENCE, MOST } from "./plots";
import { text } from "./words";
import type { Fields } from "./wire";

const SHOWN = 60; // names at once

interface Props {
  fields: Fields | null;
  beside: boolean; // there is another log
  full: boolean; // no more may be chosen
  open(): void;
  choose(name: string): void;
}

export function Chooser({ fields, beside, full, open, choose }: Props) {
  const [typed, setTyped] = useState("");
  const [shown, setShown] = useState(false);
  const [at, setAt] = useState(0);
  const [of, setOf] = useState("");
  const list = useRef<HTMLDivElement>(null);
  useEffect(() => list.current?.scrollIntoView({ block: "nearest" }), [shown, fields]);
  const wanted = typed.toLowerCase().split(/\s+/).filter(Boolean);
  const all = shown ? (fields?.fields ?? []) : [];
  const found = all.filter(([name]) => wanted.every((word) => name.includes(word)));
  const listed = found.slice(0, SHOWN);
  const chosen = Math.min(at, listed.length - 1);
  const take = (name: string | undefined) => {
    if (!name || full) return;
    choose(of + name);
    setShown(false);
    setTyped("");
  };
  const key = (event: KeyboardEvent) => {
    const by = { ArrowDown: 1, ArrowUp: -1 }[event.key];
    if (by) {
      event.preventDefault();
      setShown(true);
      setAt(Math.min(listed.length - 1, Math.max(0, chosen + by)));
      requestAnimationFrame(() => document.getElementById("chosen-number")?.scrollIntoView({ block: "nearest" }));
    } else if (event.key === "Enter") take(listed[chosen]?.[0]);
    else if (event.key === "Escape") setShown(false);
  };
  return (
    <div class="chooser">
      {beside && (
        <select aria-label={text("whichLog")} value={of} onChange={(event) => setOf(event.currentTarget.value)}>
          <option value="">{text("ofThis")}</option>
          <option value={BESIDE}>{text("ofBeside")}</option>
          <option value={DIFFERENCE}>{text("ofDifference")}</option>
        </select>
      )}
      <input
        type="search"
        role="combobox"
        aria-label={text("addPlot")}
        aria-expanded={shown}
        aria-controls="numbers-found"
        aria-autocomplete="list"
        aria-activedescendant={shown && listed.length ? "chosen-number" : undefined}
        placeholder={full ? text("mostPlots", MOST) : text("addPlot")}
        title={text("findPlot")}
        disabled={full}
        value={typed}
        onFocus={() => {
          open();
          setShown(true);
        }}
        onInput={(event) => {
          setTyped(event.currentTarget.value);
          setAt(0);
          setShown(true);
        }}
        onKeyDown={key}
        onBlur={() => setShown(false)}
      />
      {shown && (
        <div class="found" ref={list}>
          <ul id="numbers-found" role="listbox" aria-label={text("addPlot")}>
            {listed.map(([name, unit], n) => (
              <li
                key={name}
                role="option"
                id={n === chosen ? "chosen-number" : undefined}
                aria-selected={n === chosen}
                onPointerDown={(event) => {
                  event.preventDefault(); // the field keeps the keyboard
                  take(name);
                }}
              >
                {name}
                <small>{unit}</small>
              </li>
            ))}
          </ul>
          {!fields && <p>{text("fields")}</p>}
          {fields && !found.length && <p>{text("noneFound")}</p>}
          {found.length > SHOWN && <p>{text("manyFound", found.length - SHOWN)}</p>}
        </div>
      )}
    </div>
  );
}
