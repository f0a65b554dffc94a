// What the services log, the newest last, by level, service and text.
import { useEffect, useRef, useState } from "preact/hooks";
import type { LogLines } from "../wire";
import { said } from "./words";

export interface Filter {
  level: string;
  node: string;
  text: string;
}

const NEAR_END_PX = 24;

interface Props {
  lines: LogLines["lines"];
  nodes: readonly string[];
  filter(wanted: Filter): void;
}

export function Lines({ lines, nodes, filter }: Props) {
  const [wanted, setWanted] = useState<Filter>({ level: "", node: "", text: "" });
  const list = useRef<HTMLOListElement>(null);
  const atEnd = useRef(true);
  useEffect(() => {
    if (list.current && atEnd.current) list.current.scrollTop = list.current.scrollHeight;
  }, [lines]);
  const change = (part: Partial<Filter>) => {
    const now = { ...wanted, ...part };
    setWanted(now);
    atEnd.current = true;
    filter(now);
  };
  const levels: [string, string][] = [["", said("anyLevel")], ["WARNING", said("fromWarning")], ["ERROR", said("onlyErrors")]];
  return (
    <>
      <div class="filters">
        <select name="level" aria-label={said("level")} value={wanted.level} onChange={(event) => change({ level: event.currentTarget.value })}>
          {levels.map(([level, text]) => <option key={level} value={level}>{text}</option>)}
        </select>
        <select name="node" aria-label={said("service")} value={wanted.node} onChange={(event) => change({ node: event.currentTarget.value })}>
          <option value="">{said("anyService")}</option>
          {nodes.map((node) => <option key={node} value={node}>{node}</option>)}
        </select>
        <input type="search" name="text" maxLength={80} aria-label={said("search")} placeholder={said("search")} value={wanted.text}
          onInput={(event) => change({ text: event.currentTarget.value })} />
      </div>
      {lines.length === 0 && <p class="none">{said("noLines")}</p>}
      <ol class="loglines" ref={list} tabIndex={0} aria-label={said("lines")} hidden={!lines.length}
        onScroll={({ currentTarget: e }) => (atEnd.current = e.scrollHeight - e.scrollTop - e.clientHeight < NEAR_END_PX)}>
        {lines.map(([time, level, node, text], n) => (
          <li key={n} class={level.toLowerCase()}>
            <time>{time.slice(11, 19)}</time> <b>{node}</b> {level !== "INFO" && <em>{level}</em>} <span>{text}</span>
          </li>
        ))}
      </ol>
    </>
  );
}
