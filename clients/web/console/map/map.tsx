// Who sends what to whom: sites on the left, the router between, what runs at the hub on the right. On a narrow page a list of the same.
import { useState } from "preact/hooks";
import { panelText } from "../panel_words";
import type { Numbers } from "../wire";
import { type Chip, factsOf, type Link, type Part } from "./facts";
import { mapText } from "./words";

const WIDE = 846;
const SITE = { x: 12, width: 232 };
const ROUTER = { x: 526, width: 30 };
const HUB = { x: 706, width: 128 };
const MANY = 4; // sites; more of them stand closer
const HUB_ROW = 38; // of a link of the hub: its words above its line, its figures below
const PAD = 8;
const GAP = 12;
const LETTER = 5.7; // about as wide as one of small text
const CHIP_HIGH = 15;
const LINE = 13;
const HIGH = 600;

export function FlowMap({ numbers, close }: { numbers: Numbers; close: () => void }) {
  const [at, stand] = useState(""); // the part or link that has or had the focus
  const [said, say] = useState("");
  const facts = factsOf(numbers);
  const all = [...facts.sites, facts.router, ...facts.hub].flatMap((part) => [part, ...part.links]);
  const row = facts.sites.length > MANY ? 17 : 21;
  const siteHeight = (part: Part) => heightOfSite(part, row);
  const high = Math.max(columnHeight(facts.sites, siteHeight), columnHeight(facts.hub, hubHeight)) + 2 * PAD + 8;
  const chosen = all.some(({ id }) => id === at) ? at : all[0]?.id;
  const focusable = (each: Part | Link): Focusable => ({
    role: "img",
    tabIndex: each.id === chosen ? 0 : -1,
    "aria-label": each.words,
    "data-id": each.id,
    onFocus: () => (stand(each.id), say(each.id)),
    onBlur: () => say(""),
    onPointerEnter: () => say(each.id),
    onPointerLeave: () => say(""),
  });
  const move = (event: KeyboardEvent) => {
    if (event.key === "Escape") return close();
    const now = all.findIndex(({ id }) => id === at);
    const to = { ArrowDown: now + 1, ArrowRight: now + 1, ArrowUp: now - 1, ArrowLeft: now - 1, Home: 0, End: all.length - 1 }[event.key];
    const next = to === undefined ? undefined : all[to];
    if (!next) return;
    event.preventDefault();
    [...(event.currentTarget as SVGElement).querySelectorAll<SVGGElement>("[data-id]")].find((g) => g.dataset.id === next.id)?.focus();
  };
  return (
    <figure class="map">
      <figcaption>
        <strong>{mapText("map")}</strong>
        <span>{all.find(({ id }) => id === said)?.words ?? mapText("about")}</span>
      </figcaption>
      <svg viewBox={`0 0 ${WIDE} ${high}`} role="group" aria-label={mapText("map")} onKeyDown={move}>
        <g class="box router" {...focusable(facts.router)}>
          <rect x={ROUTER.x} y={PAD} width={ROUTER.width} height={high - 2 * PAD} rx={6} />
          <text transform={`translate(${ROUTER.x + ROUTER.width / 2 + 4} ${high / 2}) rotate(-90)`} text-anchor="middle">{mapText("router")}</text>
        </g>
        {placed(facts.sites, siteHeight, high).map(([part, y]) => <SiteBox key={part.id} part={part} y={y} row={row} focusable={focusable} />)}
        {placed(facts.hub, hubHeight, high).map(([part, y]) => <HubBox key={part.id} part={part} y={y} focusable={focusable} />)}
      </svg>
    </figure>
  );
}

interface Focusable {
  role: "img";
  tabIndex: number;
  "aria-label": string;
  "data-id": string;
  onFocus(): void;
  onBlur(): void;
  onPointerEnter(): void;
  onPointerLeave(): void;
}
interface Box {
  part: Part;
  y: number;
  focusable: (each: Part | Link) => Focusable;
}

/** row: height of a link; its words stand above its line. */
function SiteBox({ part, y, row, focusable }: Box & { row: number }) {
  const [rows, lines, high] = [chipRows(part.chips), serviceLines(part), heightOfSite(part, row)];
  return (
    <>
      <g class={`box ${part.health}`} {...focusable(part)}>
        <rect x={SITE.x} y={y} width={SITE.width} height={high} rx={8} />
        <text class="name" x={SITE.x + PAD} y={y + 20}>{marked(part.health, part.name)}</text>
        <text class="beside" x={SITE.x + SITE.width - PAD} y={y + 20} text-anchor="end">{cut(part.beside, 130)}</text>
        {rows.map((chips, n) => chips.map(({ chip, x, width }) => (
          <g class={`chip ${chip.health}`} key={`${n} ${x}`}>
            <rect x={SITE.x + PAD + x} y={y + 31 + n * (CHIP_HIGH + 4)} width={width} height={CHIP_HIGH} rx={CHIP_HIGH / 2} />
            <text x={SITE.x + PAD + x + width / 2} y={y + 42 + n * (CHIP_HIGH + 4)} text-anchor="middle">{marked(chip.health, chip.label)}</text>
          </g>
        )))}
        {lines.map((line, n) => (
          <text class="services" key={n} x={SITE.x + PAD} y={y + high - PAD - 1 - (lines.length - 1 - n) * LINE}>{line}</text>
        ))}
      </g>
      {part.links.map((each, n) => (
        <g key={each.id} class={`link ${each.health} ${each.kind}`} {...focusable(each)}>
          <rect class="hit" x={SITE.x + SITE.width} y={y + 4 + n * row} width={ROUTER.x - SITE.x - SITE.width} height={row} />
          <Arrow from={SITE.x + SITE.width} to={ROUTER.x} y={y + 4 + (n + 1) * row - 2} link={each} />
          <text x={SITE.x + SITE.width + 14} y={y + 4 + (n + 1) * row - 6}>{each.label}</text>
          <text class="figures" x={ROUTER.x - 14} y={y + 4 + (n + 1) * row - 6} text-anchor="end">{marked(each.health, each.figures)}</text>
        </g>
      ))}
    </>
  );
}

function HubBox({ part, y, focusable }: Box) {
  const left = ROUTER.x + ROUTER.width;
  return (
    <>
      <g class={`box ${part.health}`} {...focusable(part)}>
        <rect x={HUB.x} y={y} width={HUB.width} height={hubHeight(part)} rx={8} />
        <text class="name" x={HUB.x + PAD} y={y + 20}>{marked(part.health, part.name)}</text>
        <text class="services" x={HUB.x + PAD} y={y + 36}>{cut(part.beside, HUB.width - 2 * PAD)}</text>
      </g>
      {part.links.map((each, n) => {
        const line = y + n * HUB_ROW + 19;
        return (
          <g key={each.id} class={`link ${each.health} ${each.kind}`} {...focusable(each)}>
            <rect class="hit" x={left} y={line - 15} width={HUB.x - left} height={HUB_ROW} />
            <Arrow from={HUB.x} to={left} y={line} link={each} />
            <text x={(left + HUB.x) / 2} y={line - 5} text-anchor="middle">{each.label}</text>
            <text class="figures" x={(left + HUB.x) / 2} y={line + 12} text-anchor="middle">{marked(each.health, each.figures)}</text>
          </g>
        );
      })}
    </>
  );
}

/** from: at the part; to: at the router. */
function Arrow({ from, to, y, link }: { from: number; to: number; y: number; link: Link }) {
  const [begin, end] = link.back ? [to, from] : [from, to];
  const way = Math.sign(end - begin);
  const tip = end - way * 3;
  return (
    <>
      <line x1={begin + way * 3} x2={tip - way * 5} y1={y} y2={y} stroke-width={1.2 + 0.8 * Math.log10(1 + link.kbit)} />
      <path d={`M${tip} ${y} l${-way * 8} -4 v8 z`} />
    </>
  );
}

/** Of one column, one above the other: in the middle of the height, and where that is more than is seen at once at its top. */
function placed(parts: readonly Part[], heightOfPart: (part: Part) => number, high: number): [Part, number][] {
  const whole = columnHeight(parts, heightOfPart);
  let y = high > HIGH ? PAD + 4 : (high - whole) / 2;
  return parts.map((part) => {
    const here = y;
    y += heightOfPart(part) + GAP;
    return [part, here];
  });
}

function columnHeight(parts: readonly Part[], heightOfPart: (part: Part) => number): number {
  return parts.reduce((sum, part) => sum + heightOfPart(part) + GAP, -GAP);
}

function heightOfSite(part: Part, row: number): number {
  return Math.max(part.links.length * row + 8, 30 + chipRows(part.chips).length * (CHIP_HIGH + 4) + serviceLines(part).length * LINE + 8);
}

/** The names of a site's services, in lines. */
function serviceLines({ services }: Part): string[] {
  const lines: string[] = [];
  for (const [n, service] of services.entries()) {
    const name = n < services.length - 1 ? `${service},` : service;
    const longer = `${lines[lines.length - 1] ?? ""} ${name}`;
    if (lines.length > 0 && longer.length * LETTER < SITE.width - 2 * PAD) lines[lines.length - 1] = longer;
    else lines.push(name);
  }
  return lines;
}

function hubHeight(part: Part): number {
  return Math.max(46, part.links.length * HUB_ROW + 6);
}

function chipRows(chips: readonly Chip[]): { chip: Chip; x: number; width: number }[][] {
  const rows: { chip: Chip; x: number; width: number }[][] = [];
  let x = Infinity;
  for (const chip of chips) {
    const width = marked(chip.health, chip.label).length * LETTER + 12;
    if (x + width > SITE.width - 2 * PAD) {
      rows.push([]);
      x = 0;
    }
    rows[rows.length - 1]!.push({ chip, x, width });
    x += width + 5;
  }
  return rows;
}

/** Not by its colour alone. */
function marked(health: Part["health"], text: string): string {
  return health === "bad" ? `! ${text}` : text;
}

/** Text that has so much room [px]. */
function cut(text: string, room: number): string {
  const most = Math.floor(room / LETTER);
  return text.length > most ? `${text.slice(0, most - 1)}…` : text;
}

/** The same in words, one below the other. */
export function FlowList({ numbers }: { numbers: Numbers }) {
  const { sites, hub } = factsOf(numbers);
  return (
    <div class="flows">
      {[...sites, ...hub].map((part) => (
        <section key={part.id} class={part.health}>
          <h3>
            {marked(part.health, part.name)} <small>{part.beside}</small>
          </h3>
          {part.chips.length > 0 && (
            <ul class="chips" aria-label={panelText("devicesHead")}>
              {part.chips.map((chip) => <li key={chip.label} class={chip.health}>{marked(chip.health, chip.label)}</li>)}
            </ul>
          )}
          {part.services.length > 0 && <p>{part.services.join(", ")}</p>}
          <ul>
            {part.links.map((each) => (
              <li key={each.id} class={`${each.health} ${each.kind}`} title={each.words}>
                <span aria-hidden="true">{each.back ? "←" : "→"}</span> {each.label}
                <b>{marked(each.health, each.figures)}</b>
              </li>
            ))}
          </ul>
        </section>
      ))}
    </div>
  );
}
