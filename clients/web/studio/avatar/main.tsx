// The avatar studio's page: an avatar looked at from all sides, in any posture and with any expression, and what is wrong with it.
import { render } from "preact";
import { frame } from "../frame";
import { said } from "../said";
import { type Pose, Stage, type View } from "./stage";
import { text } from "./words";

interface Bend {
  name: string;
  label: string;
  group: string;
  low: number;
  high: number;
  start: number;
  unit: string;
}
interface About {
  name: string;
  source: string;
  height: number;
  joints: string[];
  postures: string[];
  bends: Bend[];
}
interface Verdict {
  lines: string[];
  fit: string[];
}

declare global {
  interface Window {
    /** For programs that drive the page. joints: places of the figure's joints [m]; drawn: pictures so far; settled: whether all that was asked for is shown. */
    vistelAvatar?: { joints(): [number, number, number][]; drawn(): number; settled(): boolean };
  }
}

const VIEWS: View[] = ["whole", "face", "hands", "behind"];
const INSIDE = ["bones", "shapes", "grey"] as const;
const EXPRESSIONS = {
  neutral: {},
  smile: { mouthSmileLeft: 0.8, mouthSmileRight: 0.8, cheekSquintLeft: 0.4, cheekSquintRight: 0.4 },
  shut: { eyeBlinkLeft: 1, eyeBlinkRight: 1 },
  surprise: { browInnerUp: 1, browOuterUpLeft: 0.8, browOuterUpRight: 0.8, eyeWideLeft: 0.8, eyeWideRight: 0.8, jawOpen: 0.3 },
  frown: { browDownLeft: 1, browDownRight: 1, mouthFrownLeft: 0.6, mouthFrownRight: 0.6 },
  open: { jawOpen: 0.8 },
} satisfies Record<string, Record<string, number>>;
const FIRST = "standing";

const element = <T extends HTMLElement>(id: string) => document.getElementById(id) as T;
const trouble = element("trouble");

/** text: what is waited for or wrong; "": nothing. */
function say(words: string): void {
  trouble.hidden = !words;
  trouble.textContent = words;
}

async function got<T>(path: string, asked?: object): Promise<T> {
  const answer = await fetch(path, asked && { method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(asked) });
  const said = await answer.json();
  if (!answer.ok) throw new Error(said.error);
  return said as T;
}

class Studio {
  private readonly bends: Record<string, number> = {};
  private readonly face: Record<string, number> = {};
  private readonly inside = new Set<(typeof INSIDE)[number]>();
  private verdict: Verdict | null = null;
  private posture: string | null = FIRST; // null: that of the sliders
  private asks = 0; // postures that have been asked for
  private shows = 0; // the one that is shown

  constructor(
    private readonly about: About,
    private readonly stage: Stage,
  ) {
    for (const bend of about.bends) this.bends[bend.name] = bend.start;
    window.vistelAvatar = {
      joints: () => stage.places(),
      drawn: () => stage.drawn,
      settled: () => this.shows === this.asks && trouble.hidden,
    };
    this.views("whole");
    this.show();
  }

  async begin(): Promise<void> {
    const answer = await fetch("figure.glb");
    if (!answer.ok) throw new Error((await answer.json()).error);
    await this.stage.load(await answer.arrayBuffer());
    await this.pose();
    this.stage.look("whole");
    say("");
    this.show();
    this.verdict = await got<Verdict>("verdict.json");
    this.show();
  }

  private async pose(): Promise<void> {
    const ask = ++this.asks;
    const pose = await got<Pose>("pose", this.posture ? { posture: this.posture } : { bends: this.bends });
    if (ask < this.shows) return; // a newer one is shown
    this.shows = ask;
    this.stage.pose(pose);
  }

  private posed(): void {
    this.show();
    this.pose().catch(() => say(text("gone")));
  }

  private views(now: View | ""): void {
    render(
      <>
        {VIEWS.map((view) => (
          <button type="button" key={view} aria-pressed={view === now} onClick={() => (this.stage.look(view), this.views(view))}>
            {text(view)}
          </button>
        ))}
      </>,
      element("views"),
    );
  }

  private express(shares: Record<string, number>): void {
    for (const name of this.stage.faceShapes) this.stage.express(name, (this.face[name] = shares[name] ?? 0));
    this.show();
  }

  private show(): void {
    const { about, verdict } = this;
    const groups = [...new Set(about.bends.map((bend) => bend.group))];
    const shapes = this.stage.faceShapes;
    render(
      <>
        <section>
          <h2>{text("sound")}</h2>
          {verdict ? verdict.lines.map((line) => <p key={line}>{line}</p>) : <p>{text("judging")}</p>}
          {verdict && verdict.fit.length > 0 && (
            <details>
              <summary>{text("fit")}</summary>
              <pre class="fit">{verdict.fit.join("\n")}</pre>
            </details>
          )}
        </section>
        <section>
          <h2>{text("shows")}</h2>
          <p class="choices">
            {INSIDE.map((what) => (
              <button type="button" key={what} aria-pressed={this.inside.has(what)} onClick={() => this.showInside(what)}>{text(what)}</button>
            ))}
          </p>
        </section>
        <section>
          <h2>{text("posture")}</h2>
          <p class="choices">
            {about.postures.map((name) => (
              <button type="button" key={name} aria-pressed={this.posture === name} onClick={() => ((this.posture = name), this.posed())}>{name}</button>
            ))}
          </p>
          {groups.map((group) => (
            <div key={group}>
              {about.bends.filter((bend) => bend.group === group).map((bend) => this.bend(bend))}
            </div>
          ))}
        </section>
        <section>
          <h2>{text("expression")}</h2>
          {shapes.length === 0 && <p>{text("noFace")}</p>}
          {shapes.length > 0 && (
            <>
              <p class="choices">
                {Object.entries(EXPRESSIONS).map(([name, shares]) => (
                  <button type="button" key={name} onClick={() => this.express(shares)}>{text(name as keyof typeof EXPRESSIONS)}</button>
                ))}
              </p>
              {shapes.map((name) => (
                <Slider key={name} label={name} low={0} high={1} unit="" value={this.face[name] ?? 0}
                  turned={(value) => (this.stage.express(name, (this.face[name] = value)), this.show())} />
              ))}
            </>
          )}
        </section>
      </>,
      element("panel"),
    );
  }

  private bend(bend: Bend) {
    const turned = (value: number) => {
      this.bends[bend.name] = value;
      this.posture = null;
      this.posed();
    };
    return <Slider key={bend.name} {...bend} value={this.bends[bend.name]!} turned={turned} />;
  }

  private showInside(what: (typeof INSIDE)[number]): void {
    if (!this.inside.delete(what)) this.inside.add(what);
    this.stage.show(what, this.inside.has(what));
    this.show();
  }
}

function Slider(given: { label: string; low: number; high: number; unit: string; value: number; turned(value: number): void }) {
  const { label, low, high, unit, value, turned } = given;
  return (
    <label class="slider">
      <span>{said(label)}</span>
      <input type="range" min={low} max={high} step={unit ? 1 : 0.01} value={value} onInput={(event) => turned(Number(event.currentTarget.value))} />
      <output>{unit ? `${value.toFixed(0)}${unit}` : `${(100 * value).toFixed(0)} %`}</output>
    </label>
  );
}

async function begin(): Promise<void> {
  say(text("loading"));
  void frame("avatar");
  element("figure").setAttribute("aria-label", text("canvas"));
  element("views").setAttribute("aria-label", text("views"));
  const about = await got<About>("about.json");
  document.title = `${about.name} – VISTEL`;
  element("title").textContent = `${about.name} · ${text("tall", about.height.toFixed(2))}`;
  await new Studio(about, new Stage(element<HTMLCanvasElement>("figure"), about.joints)).begin();
}

begin().catch((fault: unknown) => say(fault instanceof TypeError ? text("gone") : fault instanceof Error ? fault.message : String(fault)));
