// Lines that people write.
import { useLayoutEffect, useRef } from "preact/hooks";
import type { Line, PersonRow } from "./wire";

const ADDRESS = /(https?:\/\/[^\s<>"]+)/;
const NEAR_PX = 40; // from the end; who has scrolled back farther is left there

interface Props {
  lines: Line[];
  people: PersonRow[];
  label: string;
  alone?: (name: string) => string; // says that a line is to one person alone
}

/** The newest is at the foot, and in sight unless somebody has scrolled back. */
export function Lines({ lines, people, label, alone }: Props) {
  const shown = (name: string) => people.find((p) => p.name === name)?.shown ?? name;
  const list = useRef<HTMLOListElement>(null);
  const atEnd = useRef(true);
  useLayoutEffect(() => {
    if (list.current && atEnd.current) list.current.scrollTop = list.current.scrollHeight;
  }, [lines]);
  const look = ({ currentTarget: at }: { currentTarget: HTMLOListElement }) =>
    (atEnd.current = at.scrollHeight - at.scrollTop - at.clientHeight < NEAR_PX);
  return (
    <ol class="lines" ref={list} role="log" aria-label={label} tabIndex={0} onScroll={look}>
      {lines.map(({ id, who, ms, text, to }) => (
        <li key={`${who} ${id}`} class={to && "alone"}>
          <b>{shown(who)}</b> {to && <i>{alone?.(shown(to))}</i>}{" "}
          <time dateTime={new Date(ms).toISOString()}>{new Date(ms).toLocaleTimeString([], { hour: "2-digit", minute: "2-digit" })}</time>
          <p>{linked(text)}</p>
        </li>
      ))}
    </ol>
  );
}

/** Addresses in a text can be followed; they learn nothing of this page. */
function linked(text: string) {
  return text.split(ADDRESS).map((part, n) =>
    n % 2 ? (
      <a key={n} href={part} target="_blank" rel="noopener noreferrer">
        {part}
      </a>
    ) : (
      part
    ),
  );
}
