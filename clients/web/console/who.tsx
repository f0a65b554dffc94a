// Who and what is in the room: a list to choose from, and what is known of the one chosen.
import { panelText } from "./panel_words";
import type { Force, Held, Numbers, PersonRow, Signals, ThingRow } from "./wire";

export type Chosen = { person?: string; thing?: string } | null;

interface Props {
  people: PersonRow[];
  things: ThingRow[];
  held: Held;
  forces: Force[];
  signals: Signals;
  numbers: Numbers | null;
  talks: ReadonlySet<string>;
  chosen: Chosen;
  choose(chosen: Chosen): void;
}

export function Who({ people, things, held, forces, signals, numbers, talks, chosen, choose }: Props) {
  const inRow = new Map(signals.raised.map(([name], n) => [name, n + 1]));
  const last = signals.raised.length + 1;
  const sorted = [...people].sort((a, b) => (inRow.get(a.name) ?? last) - (inRow.get(b.name) ?? last)); // who wants to speak comes first
  const name = (id: string) => people.find((p) => p.name === id)?.shown ?? things.find((t) => t.id === id)?.name ?? id;
  const holding = (who: string) => held.grasps.filter((g) => g[0] === who).map((g) => panelText(g[1], name(g[2])));
  const holders = (id: string) => held.grasps.filter((g) => g[2] === id).map((g) => panelText(g[1], name(g[0])));
  const touching = (id: string) => {
    const others = held.touching.flatMap(([a, b]) => (a === id ? [b] : b === id ? [a] : []));
    const here = [...new Set(others)].filter((o) => things.some((t) => t.id === o) || people.some((p) => p.name === o));
    return here.map((other) => [name(other), pressing(id, other)].filter(Boolean).join(" "));
  };
  const pressing = (one: string, other: string) => {
    const felt = forces.filter(({ who, body }) => (who === one && body === other) || (who === other && body === one));
    const newtons = felt.reduce((sum, { force }) => sum + Math.hypot(...force), 0);
    return newtons ? panelText("newtons", newtons.toFixed(1)) : "";
  };
  const person = people.find((p) => p.name === chosen?.person);
  const thing = things.find((t) => t.id === chosen?.thing);
  const muted = new Set(numbers?.people.filter((p) => p.muted).map((p) => p.name));
  const motion = numbers?.people.find((p) => p.name === person?.name);
  return (
    <>
      <section>
        <h2>{panelText("inTheRoom")}</h2>
        <ul class="choices">
          {sorted.map((p) => (
            <li key={p.name}>
              <button type="button" aria-pressed={person === p} onClick={() => choose(person === p ? null : { person: p.name })}>
                {p.shown}
                {inRow.has(p.name) && <em>{panelText("handUp", inRow.get(p.name)!)}</em>}
                <small>{muted.has(p.name) ? panelText("muted") : talks.has(p.name) ? panelText("talks") : p.site}</small>
              </button>
            </li>
          ))}
          {things.map((t) => (
            <li key={t.id}>
              <button type="button" aria-pressed={thing === t} onClick={() => choose(thing === t ? null : { thing: t.id })}>
                {t.name}
                {holders(t.id).length > 0 && <small>{panelText("isHeld")}</small>}
              </button>
            </li>
          ))}
        </ul>
      </section>
      {person && (
        <Card
          title={person.shown}
          rows={[
            [panelText("site"), person.site || "–"],
            [panelText("holds"), holding(person.name).join(", ") || panelText("nothing")],
            [panelText("touches"), touching(person.name).join(", ") || panelText("nothing")],
            [panelText("motions"), motion ? panelText("motionsAndAge", motion.motions_per_s.toFixed(0), motion.age_ms.toFixed(0)) : "–"],
          ]}
        />
      )}
      {thing && (
        <Card
          title={thing.name}
          rows={[
            [panelText("shape"), thing.shape],
            [panelText("mass"), thing.mass_kg ? `${thing.mass_kg} kg` : panelText("standsFast")],
            [panelText("heldBy"), holders(thing.id).join(", ") || panelText("nobody")],
            [panelText("touches"), touching(thing.id).join(", ") || panelText("nothingGives")],
          ]}
        />
      )}
    </>
  );
}

function Card({ title, rows }: { title: string; rows: [string, string][] }) {
  return (
    <section class="card" aria-live="polite">
      <h2>{title}</h2>
      <dl>
        {rows.map(([what, value]) => (
          <div key={what}>
            <dt>{what}</dt>
            <dd>{value}</dd>
          </div>
        ))}
      </dl>
    </section>
  );
}
