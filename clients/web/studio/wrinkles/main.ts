// The wrinkle studio's page: opens what the server holds and ties the views together.

import { speaksJapanese } from "../../console/language";
import { frame } from "../frame";
import { said, sayPage } from "../said";
import * as api from "./api";
import { BendsView } from "./bends_view";
import { byId, make, typing, words } from "./dom";
import { DriveView } from "./drive_view";
import * as edits from "./edits";
import { FigureView } from "./figure_view";
import { driveChoices, Inspector } from "./inspector";
import { Link } from "./link";
import { PinsView } from "./pins_view";
import { PlaneView } from "./plane_view";
import { SetList } from "./set_list";
import { State, type Mode, type Tool } from "./state";

const notice = byId("notice");

function say(text: string, kind: "busy" | "fault" | "good" | "" = ""): void {
  notice.textContent = said(text);
  notice.className = kind;
}

async function begin(): Promise<void> {
  const waiting = window.setInterval(() => void api.doing().then((text) => text && say(`${said(text)} …`, "busy")), 500);
  try {
    const { head, arrays } = await api.open();
    const figure = new FigureView(byId<HTMLCanvasElement>("figure"));
    figure.mesh(arrays.triangles as Uint32Array, arrays.uv as Float32Array);
    await painted(figure, head.session);
    studio(new State(head), figure);
  } finally {
    clearInterval(waiting);
  }
}

async function painted(figure: FigureView, session: string, version = 0): Promise<void> {
  const answer = await fetch(api.albedoAddress(session, version));
  if (!answer.ok) throw new api.Refusal("The texture did not come", answer.status);
  figure.paint(await createImageBitmap(await answer.blob(), { colorSpaceConversion: "none" }));
}

function studio(state: State, figure: FigureView): void {
  const plane = new PlaneView(byId<HTMLCanvasElement>("plane"), state, (text) => say(text, "busy"));
  const drive = new DriveView(byId<HTMLCanvasElement>("drive"), state);
  new Inspector(byId("inspector"), state);
  new SetList(byId("sets"), state);
  let paintings = 0;
  const repaint = (): Promise<void> => painted(figure, state.opened.session, ++paintings);
  const link: Link = new Link(state, figure, plane, () => bends, say, repaint);
  const pins = new PinsView(byId<HTMLCanvasElement>("pins"), state, figure, say);
  const bends = new BendsView(byId("bends"), state, () => {
    if (state.mode === "photograph") void pins.pose();
    else link.ask();
  });
  const { opened } = state;
  byId("title").textContent = opened.name;
  byId("file").textContent = opened.saves;
  document.title = `${opened.name} · Wrinkle studio`;

  let drawnSet = "";
  state.listen((change) => {
    if (change === "form") link.ask({ form: true });
    if (change === "look") link.ask();
    const key = `${state.selection.set} ${state.selection.side}`;
    if (change === "selection" && key !== drawnSet) {
      drawnSet = key;
      link.ask({ seek: true, focus: true });
    }
    follow();
  });

  function follow(): void {
    const { undo, redo } = state.history.next;
    enable("undo", undo !== null, `Undo ${undo ?? ""} (Ctrl+Z)`);
    enable("redo", redo !== null, `Redo ${redo ?? ""} (Ctrl+Shift+Z)`);
    byId("save").classList.toggle("dirty", state.dirty);
    for (const tool of ["select", "draw", "branch"] as const)
      byId(`tool-${tool}`).classList.toggle("chosen", state.tool === tool);
    byId("held").classList.toggle("chosen", state.held);
    faults();
    head();
  }

  function enable(id: string, can: boolean, title: string): void {
    const button = byId<HTMLButtonElement>(id);
    button.disabled = !can;
    button.title = title;
  }

  function faults(): void {
    const said = new Map(state.faults.map((f) => [f.text, f.set === null && f.shape === null ? "note" : "fault"]));
    byId("faults").replaceChildren(...[...said].slice(0, 4).map(([text, kind]) => make("li", { class: kind }, text)));
  }

  let headed = "";
  function head(): void {
    const set = state.set;
    const now = JSON.stringify([set?.name, set?.region, set?.drive, state.selection.side, state.form.sets.length]);
    if (now === headed) return;
    headed = now;
    byId("plane-title").textContent = set ? words(set.name) : said("No set");
    const sides = Object.keys(state.regionOf(set)?.planes ?? {});
    byId("sides").replaceChildren(
      ...(sides.length > 1 ? sides : []).map((side) =>
        make("button", { class: side === state.selection.side ? "chosen" : "", click: () => state.select({ side }) }, side === "left_" ? "Left" : "Right"),
      ),
    ); // prettier-ignore
    byId("driver").replaceChildren(...driveChoices(state));
  }

  function tool(which: Tool): void {
    plane.finish(true);
    if (which === "branch" && !state.wrinkle && (state.set?.wrinkles.length ?? 0) === 0) which = "draw";
    state.tool = which;
    say(HINTS[which], "");
    state.tell("look");
  }

  async function mode(which: Mode): Promise<void> {
    if (state.mode === which) return;
    plane.finish(false);
    state.mode = which;
    document.body.classList.toggle("photograph", which === "photograph");
    byId("mode-wrinkles").classList.toggle("chosen", which === "wrinkles");
    byId("mode-photograph").classList.toggle("chosen", which === "photograph");
    if (which === "wrinkles") {
      link.anew();
      return;
    }
    try {
      await pins.enter();
      figure.whole();
    } catch (fault) {
      say(fault instanceof Error ? fault.message : String(fault), "fault");
    }
  }

  async function save(): Promise<void> {
    say(`Writing ${opened.saves} …`, "busy");
    const form = structuredClone(state.form);
    try {
      const done = await api.save(opened.session, form, opened.revision);
      opened.revision = done.revision;
      state.saved = JSON.stringify(form);
      say(speaksJapanese() ? `保存しました: ${done.files.join("、")}` : `Saved ${done.files.join(" and ")}`, "good");
    } catch (fault) {
      const conflict = fault instanceof api.Refusal && fault.status === 409;
      const text = fault instanceof Error ? fault.message : String(fault);
      const again = speaksJapanese() ? "ページを再読み込みすると、保存されたものが開きます。" : "Reload the page to have what was saved.";
      say(`${said("Not saved")}: ${text}${conflict ? `. ${again}` : ""}`, "fault");
    }
    follow();
  }

  function undone(label: string | null, what: string): void {
    if (speaksJapanese()) say(label ? `${said(what)}: ${said(label)}` : `${said(what)}: なし`);
    else say(label ? `${what} ${label.toLowerCase()}` : `Nothing to ${what.toLowerCase()}`);
  }

  const click = (id: string, act: () => void): void => byId(id).addEventListener("click", act);
  click("undo", () => undone(state.undo(), "Undo"));
  click("redo", () => undone(state.redo(), "Redo"));
  click("save", () => void save());
  click("help", () => byId<HTMLDialogElement>("keys").showModal());
  click("keys-close", () => byId<HTMLDialogElement>("keys").close());
  click("mode-wrinkles", () => void mode("wrinkles"));
  click("mode-photograph", () => void mode("photograph"));
  click("photograph", () => byId("photograph-file").click());
  click("tool-select", () => tool("select"));
  click("tool-draw", () => tool("draw"));
  click("tool-branch", () => tool("branch"));
  click("held", () => {
    state.held = !state.held;
    state.tell("look");
  });
  click("seek", () => link.ask({ seek: true, focus: true }));
  click("whole", () => figure.whole());
  click("plain", () => {
    figure.plain = !figure.plain;
    byId("plain").classList.toggle("chosen", figure.plain);
    figure.redraw();
  });
  click("bends-reset", () => bends.reset());
  click("frame", () => plane.frame());

  const shapes = byId<HTMLSelectElement>("add-shape");
  for (const [name, shape] of Object.entries(opened.shapes))
    shapes.append(make("option", { value: name, title: shape.about }, words(name)));
  shapes.addEventListener("change", () => {
    if (shapes.value) edits.addShape(state, shapes.value);
    shapes.value = "";
  });
  const regions = byId<HTMLSelectElement>("add-set");
  for (const region of opened.regions)
    if (Object.keys(region.planes).length > 0) regions.append(make("option", { value: region.name }, words(region.name)));
  regions.addEventListener("change", () => {
    if (regions.value) edits.addSet(state, regions.value);
    regions.value = "";
  });

  const keys: Record<string, () => void> = {
    v: () => tool("select"),
    p: () => tool("draw"),
    b: () => tool("branch"),
    d: () => edits.duplicate(state),
    f: () => plane.frame(),
    h: () => byId("held").click(),
    g: () => byId("seek").click(),
    "?": () => byId("help").click(),
    "[": () => edits.turn(state, 5),
    "]": () => edits.turn(state, -5),
    "-": () => edits.turn(state, 0, 1 / 1.05),
    "+": () => edits.turn(state, 0, 1.05),
    "=": () => edits.turn(state, 0, 1.05),
    Delete: () => (state.mode === "photograph" ? pins.remove() : edits.remove(state)),
    Backspace: () => (state.mode === "photograph" ? pins.remove() : edits.remove(state)),
    Enter: () => void plane.finish(true),
    Escape: () => {
      if (!plane.finish(false)) state.select({ wrinkle: -1 });
      state.tool = "select";
      state.tell("look");
    },
  };
  const arrows: Record<string, [number, number]> = {
    ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1],
  }; // prettier-ignore

  window.addEventListener("keydown", (e) => {
    if (byId<HTMLDialogElement>("keys").open) return;
    const command = e.ctrlKey || e.metaKey;
    const key = e.key.length === 1 ? e.key.toLowerCase() : e.key;
    if (command && key === "s") {
      e.preventDefault();
      void save();
    } else if (command && (key === "z" || key === "y") && !typing(e)) {
      e.preventDefault();
      if (key === "y" || e.shiftKey) undone(state.redo(), "Redo");
      else undone(state.undo(), "Undo");
    } else if (!command && !e.altKey && !typing(e)) {
      const arrow = arrows[key];
      const tabs = key === "Tab" && document.activeElement === byId("plane") && state.wrinkle;
      if (arrow && state.wrinkle && !(e.target instanceof HTMLInputElement)) {
        const step = e.shiftKey ? 0.005 : 0.001;
        edits.nudge(state, [arrow[0] * step, arrow[1] * step]);
      } else if (tabs) {
        const branch = Math.max(0, state.selection.branch);
        const count = state.shape?.branches[branch]?.points.length ?? 1;
        const point = (state.selection.point + (e.shiftKey ? -1 : 1) + count) % count;
        state.select({ branch, point });
      } else if (keys[key]) keys[key]();
      else return;
      e.preventDefault();
    }
  });
  window.addEventListener("beforeunload", (e) => {
    if (state.dirty) e.preventDefault();
  });

  document.body.classList.add("ready");
  const first = state.form.sets.findIndex((s) => s.name === "sleeve_deep");
  state.select({ set: Math.max(0, first) });
  say("Drag a point, or press ? for keys", "");
  // For tests and for the curious.
  Object.assign(window, { studio: { state, plane, drive, figure, link, pins } });
}

const HINTS: Record<Tool, string> = {
  select: "",
  draw: "Click points of the curve; Enter or double-click ends it, Esc forgets it",
  branch: "Click on a curve, then points away from it; Enter ends it",
};

sayPage(document.documentElement);
void frame("wrinkles");
begin().catch((fault: unknown) => say(fault instanceof Error ? fault.message : String(fault), "fault"));
