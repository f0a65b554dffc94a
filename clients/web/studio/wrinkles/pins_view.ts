// The picture of an avatar with the net of one island over it: pins hold places of the surface where they belong on the picture.

import * as api from "./api";
import { FONT, INK } from "./colours";
import { byId, fitted, make, nextFrame, words } from "./dom";
import type { FigureView } from "./figure_view";
import { clamp } from "./geometry";
import { applied, kept, ofKept, rest, solved, type Similarity } from "./registration";
import type { State } from "./state";
import type { Pin, Vec } from "./types";

interface Island {
  number: number;
  part: string;
  box: [number, number, number, number];
}

interface Laid {
  islands: Island[];
  size: Vec;
  uv: Float32Array;
  island: Uint32Array;
  triangles: Uint32Array;
  positions: Float32Array;
  normals: Float32Array;
  picture: ImageBitmap;
}

export class PinsView {
  private laid: Laid | null = null;
  private island = 0;
  private pin = -1;
  private drag: { pan: Vec | null; name: string } | null = null;
  private zoom = 1;
  private middle: Vec = [0.5, 0.5];
  private count = 0;
  private readonly repaint = nextFrame(() => this.paint());
  private posing = false;
  private bent = false;
  /** The avatar whose texture is shown, of those that the server has. */
  private shownBase = 0;

  constructor(
    private readonly canvas: HTMLCanvasElement,
    private readonly state: State,
    private readonly figure: FigureView,
    private readonly say: (text: string, kind?: "busy" | "fault" | "good" | "") => void,
  ) {
    canvas.addEventListener("pointerdown", (e) => this.down(e));
    canvas.addEventListener("pointermove", (e) => this.move(e));
    canvas.addEventListener("pointerup", () => this.up());
    canvas.addEventListener("pointercancel", () => this.up());
    canvas.addEventListener("contextmenu", (e) => e.preventDefault());
    canvas.addEventListener("wheel", (e) => this.wheel(e), { passive: false });
    new ResizeObserver(() => this.redraw()).observe(canvas);
    state.listen((change) => {
      if (change === "form" && state.mode === "photograph") void this.follow();
    });
    const select = byId<HTMLSelectElement>("island");
    select.addEventListener("change", () => this.choose(Number(select.value)));
    const file = byId<HTMLInputElement>("photograph-file");
    file.addEventListener("change", () => void this.bring(file));
    byId("pins-clear").addEventListener("click", () => this.clear());
  }

  /** Shows the texture and the figure without wrinkles. */
  async enter(): Promise<void> {
    this.say("Unfolding the texture …", "busy");
    const { session } = this.state.opened;
    const asked = { session, form: this.state.form, bends: this.state.bends };
    const { head, arrays } = await api.unpacked<{ islands: Island[]; size: Vec }>(await api.post("api/photograph", asked));
    const address = `${api.albedoAddress(session, this.state.form.base)}&of=avatar&base=${this.state.form.base}`;
    const picture = await createImageBitmap(await (await fetch(address)).blob(), { colorSpaceConversion: "none" });
    this.laid = { ...head, ...(arrays as unknown as Omit<Laid, "islands" | "size" | "picture">), picture };
    const { laid } = this;
    byId("island").replaceChildren(
      ...laid.islands.map((i) => make("option", { value: i.number, selected: i.number === this.island }, `${i.number}  ${words(i.part)}`)),
    );
    this.figure.mesh(laid.triangles, laid.uv);
    this.figure.shade(new Uint8Array([128]), [1, 1], [0, 0, 1, 1]);
    this.figure.paint(laid.picture);
    this.choose(laid.islands.some((i) => i.number === this.island) ? this.island : 0);
    this.say("Click the net to set a pin; drag pins to where they belong on the picture", "");
  }

  /** Bends the figure as the sliders say; the newest that is asked for comes last. */
  async pose(): Promise<void> {
    if (!this.laid) return;
    this.bent = true;
    if (this.posing) return;
    this.posing = true;
    try {
      while (this.bent) {
        this.bent = false;
        const { session } = this.state.opened;
        const asked = { session, form: this.state.form, bends: this.state.bends };
        const { arrays } = await api.unpacked(await api.post("api/photograph", asked));
        this.laid.positions = arrays.positions as Float32Array;
        this.laid.normals = arrays.normals as Float32Array;
        this.redraw();
      }
    } catch (fault) {
      this.say(fault instanceof Error ? fault.message : String(fault), "fault");
    } finally {
      this.posing = false;
    }
  }


  private async follow(): Promise<void> {
    if (this.shownBase !== this.state.form.base) {
      this.shownBase = this.state.form.base;
      await this.enter();
    }
    this.redraw();
  }

  private choose(island: number): void {
    this.island = island;
    this.pin = -1;
    const box = this.laid?.islands.find((i) => i.number === island)?.box;
    if (box && this.laid) {
      const [w, h] = this.laid.size;
      this.middle = [((box[0] + box[2]) / 2) * w, ((box[1] + box[3]) / 2) * h];
      const { clientWidth, clientHeight } = this.canvas;
      this.zoom = 0.8 * Math.min(clientWidth / ((box[2] - box[0]) * w + 1), clientHeight / ((box[3] - box[1]) * h + 1));
    }
    this.redraw();
  }

  private async bring(file: HTMLInputElement): Promise<void> {
    const chosen = file.files?.[0];
    file.value = "";
    if (!chosen) return;
    this.say(`Laying ${chosen.name} …`, "busy");
    try {
      const answer = await api.picture(this.state.opened.session, this.island, this.state.form.base, chosen);
      this.shownBase = answer.base;
      const { island } = this;
      this.state.edit("Photograph", (form) => {
        form.base = answer.base;
        form.pins = form.pins.filter((p) => p.island !== island);
        form.texture = form.texture.filter((t) => t.island !== island);
      });
      await this.enter();
      this.say(answer.notes.join("; ") || `${chosen.name} lies on the island; pin it`, "good");
    } catch (fault) {
      this.say(fault instanceof Error ? fault.message : String(fault), "fault");
    }
  }

  private clear(): void {
    const { island } = this;
    this.state.edit("Clear pins", (form) => {
      form.pins = form.pins.filter((p) => p.island !== island);
      form.texture = form.texture.filter((t) => t.island !== island);
    });
    this.pin = -1;
  }

  /** Deletes the selected pin; the rest hold the texture. */
  remove(): void {
    const gone = this.mine()[this.pin];
    if (!gone) return;
    this.pin = -1;
    this.change("Delete pin", (pins) => pins.filter((p) => JSON.stringify(p) !== JSON.stringify(gone)));
  }

  private mine(): Pin[] {
    return this.state.form.pins.filter((p) => p.island === this.island);
  }

  private centre(island: number): Vec {
    const box = this.laid?.islands.find((i) => i.number === island)?.box ?? [0, 0, 1, 1];
    return [(box[0] + box[2]) / 2, (box[1] + box[3]) / 2];
  }

  private similarity(island = this.island): Similarity {
    const said = this.state.form.texture.find((t) => t.island === island);
    return ofKept(said, this.centre(island), this.laid?.size ?? [1, 1]);
  }

  private change(label: string, how: (pins: Pin[]) => Pin[], merge = ""): void {
    const { laid, island } = this;
    if (!laid) return;
    const [w, h] = laid.size;
    const before = this.similarity();
    this.state.edit(label, (form) => {
      const mine = how(form.pins.filter((p) => p.island === island));
      form.pins = [...form.pins.filter((p) => p.island !== island), ...mine];
      const texels = (p: Vec): Vec => [p[0] * w, p[1] * h];
      const found = solved(mine.map((p) => texels(p.from)), mine.map((p) => texels(p.to)), before);
      form.texture = form.texture.filter((t) => t.island !== island);
      if (mine.length > 0) form.texture.push(kept(island, found, this.centre(island), laid.size));
    }, merge); // prettier-ignore
  }

  /** Texels to CSS pixels; the picture's first row is v = 1. */
  toScreen(p: Vec): Vec {
    const { clientWidth, clientHeight } = this.canvas;
    return [clientWidth / 2 + (p[0] - this.middle[0]) * this.zoom, clientHeight / 2 - (p[1] - this.middle[1]) * this.zoom];
  }

  private toTexels(s: Vec): Vec {
    const { clientWidth, clientHeight } = this.canvas;
    return [this.middle[0] + (s[0] - clientWidth / 2) / this.zoom, this.middle[1] - (s[1] - clientHeight / 2) / this.zoom];
  }

  private at(e: MouseEvent): Vec {
    const box = this.canvas.getBoundingClientRect();
    return [e.clientX - box.left, e.clientY - box.top];
  }

  private down(e: PointerEvent): void {
    const { laid } = this;
    if (!laid) return;
    this.canvas.focus();
    this.canvas.setPointerCapture(e.pointerId);
    const s = this.at(e);
    const [w, h] = laid.size;
    const name = `pin ${++this.count}`;
    if (e.button !== 0) {
      this.drag = { pan: s, name };
      return;
    }
    this.pin = this.mine().findIndex((p) => {
      const at = this.toScreen([p.to[0] * w, p.to[1] * h]);
      return Math.hypot(at[0] - s[0], at[1] - s[1]) < 10;
    });
    if (this.pin < 0 && this.onNet(s)) {
      const to = this.toTexels(s);
      const { a, b, t } = this.similarity();
      const k = a * a + b * b;
      const d: Vec = [to[0] - t[0], to[1] - t[1]];
      const from: Vec = [(a * d[0] + b * d[1]) / k / w, (-b * d[0] + a * d[1]) / k / h];
      const pin: Pin = { island: this.island, from, to: [to[0] / w, to[1] / h] };
      this.change("Set pin", (pins) => [...pins, pin], name);
      this.pin = this.mine().length - 1;
    }
    this.drag = { pan: this.pin < 0 ? s : null, name };
    this.redraw();
  }

  /** Whether a corner of the island's net is near. */
  private onNet(s: Vec): boolean {
    const { laid } = this;
    if (!laid) return false;
    const how = this.similarity();
    const [w, h] = laid.size;
    let least = Infinity;
    for (let k = 0; k < laid.island.length; k++) {
      if (laid.island[k] !== this.island) continue;
      const at = this.toScreen(applied(how, [(laid.uv[2 * k] as number) * w, (laid.uv[2 * k + 1] as number) * h]));
      least = Math.min(least, Math.hypot(at[0] - s[0], at[1] - s[1]));
    }
    return least < 24;
  }

  private move(e: PointerEvent): void {
    const { drag, laid } = this;
    if (!drag || !laid) return;
    const s = this.at(e);
    if (drag.pan) {
      this.middle = [this.middle[0] - (s[0] - drag.pan[0]) / this.zoom, this.middle[1] + (s[1] - drag.pan[1]) / this.zoom];
      drag.pan = s;
      this.redraw();
      return;
    }
    const to = this.toTexels(s);
    const number = this.pin;
    this.change("Move pin", (pins) =>
      pins.map((p, k) => (k === number ? { ...p, to: [to[0] / laid.size[0], to[1] / laid.size[1]] } : p)), drag.name); // prettier-ignore
  }

  private up(): void {
    this.drag = null;
    this.state.history.seal();
  }

  private wheel(e: WheelEvent): void {
    e.preventDefault();
    const s = this.at(e);
    const before = this.toTexels(s);
    this.zoom = clamp(this.zoom * Math.exp(-e.deltaY * 0.0015), 0.02, 60);
    const after = this.toTexels(s);
    this.middle = [this.middle[0] + before[0] - after[0], this.middle[1] + before[1] - after[1]];
    this.redraw();
  }

  redraw(): void {
    if (this.state.mode === "photograph") this.repaint();
  }

  private paint(): void {
    const ratio = fitted(this.canvas);
    const ink = this.canvas.getContext("2d");
    const { laid } = this;
    if (!ink || !laid) return;
    ink.setTransform(ratio, 0, 0, ratio, 0, 0);
    const { clientWidth, clientHeight } = this.canvas;
    ink.fillStyle = INK.back;
    ink.fillRect(0, 0, clientWidth, clientHeight);
    const [w, h] = laid.size;
    const [left, top] = this.toScreen([0, h]);
    ink.drawImage(laid.picture, left, top, w * this.zoom, h * this.zoom);
    const how = this.similarity();
    ink.strokeStyle = "rgba(88,214,169,0.5)";
    ink.lineWidth = 0.7;
    ink.beginPath();
    const place = (k: number): Vec =>
      this.toScreen(applied(how, [(laid.uv[2 * k] as number) * w, (laid.uv[2 * k + 1] as number) * h]));
    for (let t = 0; t < laid.triangles.length; t += 3) {
      const [i, j, k] = [laid.triangles[t], laid.triangles[t + 1], laid.triangles[t + 2]] as [number, number, number];
      if (laid.island[i] !== this.island) continue;
      const [a, b, c] = [place(i), place(j), place(k)];
      ink.moveTo(a[0], a[1]);
      ink.lineTo(b[0], b[1]);
      ink.lineTo(c[0], c[1]);
    }
    ink.stroke();
    this.paintPins(ink, how);
    this.dress();
  }

  private paintPins(ink: CanvasRenderingContext2D, how: Similarity): void {
    const [w, h] = this.laid?.size ?? [1, 1];
    const pins = this.mine();
    const away = rest(pins, how, [w, h]);
    ink.font = FONT;
    ink.textBaseline = "middle";
    pins.forEach((pin, k) => {
      const to = this.toScreen([pin.to[0] * w, pin.to[1] * h]);
      const at = this.toScreen(applied(how, [pin.from[0] * w, pin.from[1] * h]));
      ink.strokeStyle = INK.fault;
      ink.lineWidth = 1.5;
      ink.beginPath();
      ink.moveTo(at[0], at[1]);
      ink.lineTo(to[0], to[1]);
      ink.stroke();
      ink.beginPath();
      ink.arc(to[0], to[1], 6, 0, 2 * Math.PI);
      ink.fillStyle = k === this.pin ? INK.bright : INK.pin;
      ink.fill();
      ink.strokeStyle = "#0b0c0d";
      ink.lineWidth = 2;
      ink.stroke();
      if ((away[k] as number) >= 1) {
        ink.fillStyle = INK.bright;
        ink.fillText(`${(away[k] as number).toFixed(0)} px off`, to[0] + 11, to[1]);
      }
    });
  }

  /** The figure with the texture as pins hold it. */
  private dress(): void {
    const { laid } = this;
    if (!laid) return;
    const [w, h] = laid.size;
    const moved = laid.uv.slice();
    for (const said of this.state.form.texture) {
      const how = this.similarity(said.island);
      for (let k = 0; k < laid.island.length; k++) {
        if (laid.island[k] !== said.island) continue;
        const at = applied(how, [(laid.uv[2 * k] as number) * w, (laid.uv[2 * k + 1] as number) * h]);
        moved[2 * k] = at[0] / w;
        moved[2 * k + 1] = at[1] / h;
      }
    }
    this.figure.pose(laid.positions, laid.normals, moved);
  }
}
