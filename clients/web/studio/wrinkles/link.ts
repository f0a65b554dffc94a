// Keeps the figure and the plane as the page says: one request at a time, the newest waiting one next, those between left out.

import * as api from "./api";
import type { BendsView } from "./bends_view";
import type { FigureView } from "./figure_view";
import type { PlaneView } from "./plane_view";
import type { State } from "./state";
import type { Updated } from "./types";

const LATER_MS = 60;
const SLOW_MS = 700;

export class Link {
  private version = 0;
  private busy = false;
  private formWaits = false;
  private waits = false;
  private seek = false;
  private focus = false;
  private timer = 0;
  private whole = false;
  /** Told when all that was asked for is shown. */
  settled: () => void = () => undefined;

  constructor(
    private readonly state: State,
    private readonly figure: FigureView,
    private readonly plane: PlaneView,
    private readonly bends: () => BendsView,
    private readonly say: (text: string, kind: "busy" | "fault" | "") => void,
    private readonly repaint: () => Promise<void>,
  ) {}

  /** The figure was used for something else: everything of it is to come again. */
  anew(): void {
    this.version = 0;
    this.whole = true;
    this.ask({ form: true });
  }

  /** Something changed. form: what is edited; seek: the figure is to bend until the selected set is strongest. */
  ask(what: { form?: boolean; seek?: boolean; focus?: boolean } = {}): void {
    this.waits = true;
    this.formWaits ||= what.form ?? false;
    this.seek ||= what.seek ?? false;
    this.focus ||= what.focus ?? false;
    clearTimeout(this.timer);
    this.timer = window.setTimeout(() => void this.send(), this.formWaits ? LATER_MS : 0);
  }

  get idle(): boolean {
    return !this.busy && !this.waits;
  }

  private async send(): Promise<void> {
    if (this.busy || !this.waits) return;
    const { state } = this;
    const { set, side } = state.selection;
    const asked: api.UpdateRequest = {
      bends: state.bends,
      held: state.held && state.set && state.mode === "wrinkles" ? [state.set.name] : [],
      have: this.version,
      plane: { set, side },
    };
    if (state.mode === "photograph") {
      // The plane is not seen; the page catches up when it is.
      this.waits = false;
      return;
    }
    if (this.whole) asked.whole = true;
    if (this.formWaits) asked.form = structuredClone(state.form);
    const { seek, focus } = this;
    if (seek) asked.seek = { set, side };
    if (focus) asked.focus = { set, side };
    this.waits = this.formWaits = this.seek = this.focus = false;
    this.busy = true;
    const slow = window.setInterval(() => void this.tellSlow(), SLOW_MS);
    try {
      const { head, arrays } = await api.update(state.opened.session, asked);
      if (head.albedo && arrays.triangles && arrays.still) {
        this.figure.mesh(arrays.triangles as Uint32Array, arrays.still as Float32Array);
        await this.repaint();
        this.whole = false;
      }
      this.take(head, arrays, seek && !this.seek);
      this.say("", "");
    } catch (fault) {
      this.version = 0;
      this.say(fault instanceof Error ? fault.message : String(fault), "fault");
    } finally {
      clearInterval(slow);
      this.busy = false;
    }
    if (this.waits) void this.send();
    else this.settled();
  }

  private async tellSlow(): Promise<void> {
    const text = await api.doing().catch(() => "");
    if (this.busy) this.say(text || "Working", "busy");
  }

  private take(head: Updated, arrays: api.Arrays, sought: boolean): void {
    const { state } = this;
    state.sets = head.sets;
    state.faults = head.faults;
    if (head.jitters) state.jitters = head.jitters;
    if (sought) {
      state.bends = head.bends;
      this.bends().follow();
    }
    this.figure.pose(arrays.positions as Float32Array, arrays.normals as Float32Array, arrays.uv as Float32Array);
    if (arrays.light && head.light.size && head.light.rect)
      this.figure.shade(arrays.light as Uint8Array, head.light.size, head.light.rect);
    this.version = head.light.version;
    const { set, side } = state.selection;
    if (arrays.plane && head.plane && head.planeSize && head.plane.set === set && head.plane.side === side)
      this.plane.show(arrays.plane as Uint8Array, head.planeSize[0], head.planeSize[1]);
    if (head.focus) this.figure.focus(head.focus.middle, head.focus.facing, head.focus.radius);
    state.tell("answer");
  }
}
