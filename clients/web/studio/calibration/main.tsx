// The calibration studio's page: what can be measured, what is asked, what the devices see, what was found.
import { render } from "preact";
import { frame } from "../frame";
import { asked, said } from "../said";
import { forget, type Live, LiveView, remember } from "./live";
import { text } from "./words";

type What = "body" | "tracker" | "left_glove" | "right_glove" | "face" | "gaze";
type Verdict = "good" | "fair" | "poor";
interface Offer {
  participant: string;
  what: What;
  device: string;
  kind: string;
  port: string;
  file: string;
  key: string; // where the conference file names it, within the participant
  exists: boolean;
}
interface Now {
  participant: string;
  what: What;
  say: string;
  phase: "asks" | "ready" | "go" | "done" | "failed";
  left: number;
  fault: string;
  kept: string;
  found: { verdict: Verdict; rows: [string, string, Verdict | ""][]; notes: string[] } | null;
  live: Live;
}

const element = <T extends HTMLElement>(id: string) => document.getElementById(id) as T;
const page: { conference: string; offers: Offer[]; now: Now | null; trouble: string; over: boolean } = {
  conference: "",
  offers: [],
  now: null,
  trouble: "",
  over: false,
};

async function post(path: string, asked: object = {}): Promise<number> {
  try {
    const answer = await fetch(path, { method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(asked) });
    const said = await answer.json();
    page.trouble = answer.ok || answer.status === 409 ? "" : said.error;
    return answer.status;
  } catch {
    page.trouble = text("gone");
    return 0;
  } finally {
    show();
  }
}

async function begin({ participant, what }: { participant: string; what: What }): Promise<void> {
  forget();
  page.over = false;
  await post("start", { participant, what });
}

async function keep(): Promise<void> {
  page.over = (await post("keep", { over: page.over })) === 409;
  await offered();
}

async function offered(): Promise<void> {
  const answer = await fetch("offers.json");
  Object.assign(page, await answer.json());
  element("title").textContent = page.conference;
  show();
}

function show(): void {
  render(<Stage />, element("stage"));
  render(<Offers />, element("panel"));
}

function Stage() {
  const { now, trouble } = page;
  if (!page.conference) {
    return (
      <>
        <p class="say">{text("none")}</p>
        <p><code>vistel studio --conference conference.toml</code></p>
      </>
    );
  }
  if (!now) return <p class={trouble ? "say fault" : "say"} role="status">{trouble || text(page.offers.length ? "choose" : "nothing")}</p>;
  const ended = now.phase === "done" || now.phase === "failed";
  const seconds = Math.ceil(now.left);
  return (
    <>
      <h2>{text("of", now.participant, text(now.what))}</h2>
      {!ended && <p class="say" role="status">{asked(now.say)}</p>}
      {now.phase === "ready" && <p class="count">{text("ready", seconds)}</p>}
      {now.phase === "go" && <p class="count go">{text("go", seconds)}</p>}
      {now.fault && <p class="say fault" role="alert">{now.fault}</p>}
      {trouble && <p class="fault" role="alert">{trouble}</p>}
      {now.found && <Found now={now} found={now.found} />}
      {!now.found && <LiveView live={now.live} />}
      <p class="choices">
        {ended ? (
          <button type="button" id="again" onClick={() => void begin(now)}>{text("again")}</button>
        ) : (
          <button type="button" id="stop" onClick={() => void post("stop")}>{text("stop")}</button>
        )}
        {now.found && !now.kept && (
          <button type="button" id="keep" onClick={() => void keep()}>{page.over ? text("over", offerOf(now)?.file ?? "") : text(now.found.verdict === "poor" ? "keepPoor" : "keep")}</button>
        )}
      </p>
    </>
  );
}

function Found({ now, found }: { now: Now; found: NonNullable<Now["found"]> }) {
  return (
    <section>
      <p class="say">
        {text("found")}: <span class={`verdict-${found.verdict}`}>{text(found.verdict)}</span>
      </p>
      <table>
        <tbody>
          {found.rows.map(([what, figure, verdict]) => (
            <tr key={what}>
              <th>{said(what.replaceAll("_", " "))}</th>
              <td>{figure}</td>
              <td>{verdict && <span class={`verdict-${verdict}`}>{text(verdict)}</span>}</td>
            </tr>
          ))}
        </tbody>
      </table>
      {found.notes.map((note) => <p key={note}>{note}</p>)}
      {now.kept && (
        <>
          <p>{text("kept", now.kept, now.participant)}</p>
          <p><code>{`${offerOf(now)?.key ?? ""} = "${now.kept}"`}</code></p>
        </>
      )}
    </section>
  );
}

function offerOf(now: Now): Offer | undefined {
  return page.offers.find(({ participant, what }) => participant === now.participant && what === now.what);
}

function Offers() {
  const people = [...new Set(page.offers.map((offer) => offer.participant))];
  const chosen = page.now && offerOf(page.now);
  return (
    <>
      {people.map((name) => (
        <section key={name}>
          <h2>{name}</h2>
          {page.offers.filter((offer) => offer.participant === name).map((offer) => (
            <div class="offer" key={offer.what}>
              <span>
                {text(offer.what)}
                <small>{text(`why_${offer.what}`)}</small>
                <small>{offer.kind}, {offer.port}{offer.exists && ` · ${text("exists", offer.file)}`}</small>
              </span>
              <button type="button" data-what={`${name} ${offer.what}`} aria-pressed={offer === chosen} onClick={() => void begin(offer)}>{text("begin")}</button>
            </div>
          ))}
        </section>
      ))}
    </>
  );
}

function listen(): void {
  const events = new EventSource("now");
  events.onmessage = ({ data }) => {
    page.now = JSON.parse(data);
    if (page.trouble === text("gone")) page.trouble = "";
    remember(page.now?.live.receivers ?? {});
    show();
  };
  events.onerror = () => {
    page.trouble = text("gone"); // the browser asks again by itself
    show();
  };
}

void frame("calibration");
element("stage").replaceChildren(); // what missing.js would have written into
document.title = `${text("title")} – VISTEL`;
void offered().then(listen);
