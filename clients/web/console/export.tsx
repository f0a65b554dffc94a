// Something of a log as a file: what the server writes, and the commands for what takes longer.
import { useState } from "preact/hooks";
import { text } from "./words";

interface Props {
  path: string;
  people: string[];
  from: number;
  to: number; // of the part that is meant [s]
  names: readonly string[]; // of numbers that are plotted
  offset: number;
}

/** Where a file is written to be loaded down. */
export function exportAddress(kind: string, of: readonly string[], { from, to, offset }: Pick<Props, "from" | "to" | "offset">): string {
  const asked = new URLSearchParams({ kind, from: from.toFixed(4), to: to.toFixed(4), offset: String(offset) });
  for (const name of of) asked.append("of", name);
  return `export?${asked}`;
}

export function Export(props: Props) {
  const { path, people, from, to, names } = props;
  const [copied, setCopied] = useState("");
  const link = (kind: string, of: readonly string[], said: string) => (
    <a href={exportAddress(kind, of, props)} download>
      {said}
    </a>
  );
  const part = `--from ${from.toFixed(2)} --to ${to.toFixed(2)}`;
  const commands: [string, string][] = [
    [text("film"), `vistel replay ${quoted(path)} --render --view room ${part}`],
    [text("usd"), `vistel log export ${quoted(path)} -o meeting.usda ${part}`],
  ];
  return (
    <details class="export">
      <summary>{text("export")}</summary>
      <div class="files">
        <p>{text("exportPart", from.toFixed(2), to.toFixed(2))}</p>
        <ul class="choices">
          <li>{link("mcap", [], text("cutLog"))}</li>
          {names.length > 0 && <li>{link("csv", names, text("csv"))}</li>}
          {(["bvh", "glb", "wav"] as const).flatMap((kind) =>
            people.map((name) => <li key={`${kind} ${name}`}>{link(kind, [name], text(kind, name))}</li>),
          )}
        </ul>
        {commands.map(([what, command]) => (
          <p key={what} class="command">
            <span>{what}</span>
            <code>{command}</code>
            <button type="button" onClick={() => void navigator.clipboard.writeText(command).then(() => setCopied(what))}>
              {text(copied === what ? "copied" : "copy")}
            </button>
          </p>
        ))}
      </div>
    </details>
  );
}

/** As one word of a shell. */
function quoted(word: string): string {
  return /^[\w./:-]+$/.test(word) ? word : `'${word.replaceAll("'", `'\\''`)}'`;
}
