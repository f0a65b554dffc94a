// The room: what does not move, things, people, and the picture of it all.
import {
  Color,
  DoubleSide,
  Group,
  Matrix4,
  Mesh,
  MeshBasicMaterial,
  PerspectiveCamera,
  type DirectionalLight,
  Raycaster,
  Scene,
  ShadowMaterial,
  Vector2,
  Vector3,
  WebGLRenderer,
} from "three";
import { Contacts } from "./contacts";
import { DentedThings } from "./dents";
import { dispose } from "./dispose";
import { Figure } from "./figures/figure";
import { Files } from "./files";
import { lit } from "./light";
import { drawnBySoftware } from "./pictures";
import { Screens } from "./screens";
import type { Skin } from "./figures/skin";
import type { Forces, Frame, Held, Ink, Joints, PersonRow, Signals, Table, ThingRow } from "./wire";
import { INK, Written } from "./written";

const FRAME_MS = 1000 / 30;
const SHADOW = 0.5; // share of the light on floor and table that the key light gives
const NEAR_M = 0.14; // from a ray to a joint: the person is meant
const SLOW_MS = 45; // pictures that take longer get coarser
const COARSEST = 0.5;
const AHEAD = 2; // pictures that are asked for while the one before is not there yet, at most
const COARSE = 0.7; // sharpness below which shadows are coarse, and drawn anew only
const SELDOM = 3; // at every third picture
const QUICK_MS = 14; // and finer again below
const LOOK_MS = 4; // from one look whether a picture is there to the next
const SEEN_MS = 200; // from one picture that is looked after to the next

const WORN_NEAR_M = 0.05; // to a headset's eye
const PAGE = 0.8; // how bright a page of a panel is: 0.9 as it is seen
const SKIN_M = 0.05; // over a joint
const STILL = 2e-5; // the camera rests where no number of its matrices changes by more from one picture to the next

export interface Picked {
  person?: string;
  thing?: string;
  at: Vector3;
}

export class Room {
  readonly camera = new PerspectiveCamera(45, 1, 0.03, 30);
  readonly figures = new Map<string, Figure>();
  /** Of the log beside the one that is seen. */
  readonly ghosts = new Map<string, Figure>();
  readonly things = new Map<string, { about: ThingRow; node: Group }>();
  /** What touches who or what is chosen. */
  readonly contacts = new Contacts();
  readonly dents = new DentedThings(() => this.change());
  readonly written = new Written(() => this.change());
  readonly screens = new Screens(() => this.change(), () => this.renderer.capabilities.getMaxAnisotropy());
  /** Told of whatever changes what is seen: the room is to be drawn again (pictures.ts). */
  changed: (() => void) | null = null;
  /** Pictures that have been drawn. */
  drawn = 0;
  /** As fast as pictures come while something moves. */
  picturesPerS = 0;
  /** Told now and then: of which conference time a picture was, and when it was there (of `performance`) [ms]. */
  seen: ((tMs: number, atMs: number) => void) | null = null;
  /** From one picture of which that is told to the next [ms]. */
  seenEveryMs = SEEN_MS;
  private readonly renderer: WebGLRenderer;
  private readonly scene = new Scene();
  private readonly files = new Files();
  private readonly waiting: (() => void)[] = []; // for the next picture to be there
  private readonly key: DirectionalLight;
  private joints: Joints | null = null;
  private table: Table | null = null;
  private besideTable: Table | null = null;
  private shell: string | null = null;
  private walls = false; // they are in the picture
  private readonly firsts = new Set<string>(); // pictures that have been marked
  private newest: { tMs: number; arrived: number } | null = null;
  private movedAt = -Infinity; // when a frame came that was another than the one before
  private fresh = false; // nothing has changed since the last picture
  private went = false; // something still moved in the last picture
  private unfinished = 0; // pictures that have been asked for and are not there
  private readonly from = new Matrix4(); // camera of the last picture
  private readonly through = new Matrix4(); // and its projection
  private heldNow: Held = { kind: "held", grasps: [], touching: [] };
  private signalsNow: Signals = { kind: "signals", raised: [], reactions: [] };
  private seenAt = 0;
  private took = FRAME_MS;
  private last = 0;
  private fixed = false;
  private sharpness = 1;
  private worn: Group | null = null; // the headset's space
  private looksOutOf = "";

  /** Raises where there is no WebGL. */
  constructor(readonly canvas: HTMLCanvasElement) {
    const software = drawnBySoftware();
    this.renderer = new WebGLRenderer({ canvas, antialias: !software, powerPreference: "high-performance" });
    this.scene.background = new Color(0x23272b);
    this.scene.add(this.contacts.root);
    this.key = lit(this.scene, this.renderer);
    if (software) this.sharpen(COARSEST);
    new ResizeObserver(() => this.resize()).observe(canvas);
    canvas.addEventListener("webglcontextlost", (event) => event.preventDefault()); // three.js takes it up again when it is back
    canvas.addEventListener("webglcontextrestored", () => this.change());
    this.resize();
  }

  /** Files are asked for with the token of a guest's link. */
  show(token: string): void {
    this.files.show(token);
  }

  get held(): Held {
    return this.heldNow;
  }
  set held(held: Held) {
    this.heldNow = held;
    this.change();
  }

  get signals(): Signals {
    return this.signalsNow;
  }
  set signals(signals: Signals) {
    this.signalsNow = signals;
    this.change();
  }

  begin(joints: Joints): void {
    this.joints = joints;
  }

  receiveTable(table: Table): void {
    if (!this.joints) return;
    this.table = table;
    const joints = this.joints;
    if (table.room && table.room !== this.shell) void this.showShell((this.shell = table.room));
    this.showPeople(this.figures, table, joints, false);
    this.keepOnly(this.things, new Set(table.things.map((t) => t.id)), ({ node, about: { id } }) => (this.drop(node), this.dents.forget(id)));
    for (const about of table.things) void this.showThing(about);
    this.written.show(this.things);
    this.screens.show(this.things);
    this.change();
  }

  receiveInk(ink: Ink): void {
    this.written.receive(ink);
    this.written.show(this.things);
    this.change();
  }

  receiveForces({ touches }: Forces): void {
    if (this.contacts.receive(touches, this.figures)) this.change();
  }

  receiveSkin({ people }: Skin): void {
    for (const [name, figure] of this.figures) figure.press(people.find(({ who }) => who === name) ?? null);
    this.change();
  }

  /** People of another log, who are seen as ghosts; null: there is none. */
  receiveBeside(table: Table | null): void {
    this.besideTable = table;
    if (this.joints) this.showPeople(this.ghosts, table ?? { people: [] }, this.joints, true);
    this.change();
  }

  receiveBesideFrame(frame: Frame): void {
    if (frame.table !== this.besideTable?.table) return;
    this.pose(this.ghosts, frame, this.besideTable, performance.now());
  }

  receiveFrame(frame: Frame): void {
    if (!this.table || frame.table !== this.table.table) return;
    const now = performance.now();
    this.newest = { tMs: frame.tMs, arrived: now };
    this.screens.at(frame.tMs);
    this.pose(this.figures, frame, this.table, now);
    for (const thing of frame.things) {
      const about = this.table.things[thing.what];
      const node = about && this.things.get(about.id)?.node;
      if (!node || (node.visible && alike(node, thing))) continue;
      node.position.set(...thing.position);
      node.quaternion.set(...thing.rotation);
      node.visible = true;
      this.change();
    }
    if (this.fresh && now - this.seenAt > this.seenEveryMs) {
      this.seenAt = now;
      this.seen?.(frame.tMs, now); // the picture that is there shows this moment, too
    }
  }

  /** Take figures to where they are at a time of `performance` [ms]; what looks from or at them is placed after it, before `draw`. */
  step(now: number): void {
    for (const figure of [...this.figures.values(), ...this.ghosts.values()]) figure.step(now, this.overMs);
    if (this.worn) this.figures.get(this.looksOutOf)?.behead(true);
  }

  /** Draw; now: as of `step`. Whether something moves, so that the next picture will be another. */
  draw(now: number): boolean {
    const moves = now - this.movedAt < FRAME_MS || this.cameraMoved();
    this.fresh = true;
    this.drawn++;
    this.renderer.shadowMap.autoUpdate = !moves || this.sharpness > COARSE || this.drawn % SELDOM === 0;
    this.renderer.render(this.scene, this.camera);
    const first = this.first();
    const told = this.newest && (first.length > 0 || this.waiting.length > 0 || now - this.seenAt > this.seenEveryMs);
    if (told) this.seenAt = now;
    this.lookAfter(told ? this.newest!.tMs - Math.max(0, this.newest!.arrived + this.overMs - now) : null, first);
    this.adapt(now);
    return (this.went = moves);
  }

  /** Whether a picture can be asked for: where they are slow, one that waited behind others would show what is old when it is there. */
  get ready(): boolean {
    return this.unfinished < (this.took > SLOW_MS ? 1 : AHEAD);
  }

  /** Draw for a headset from now on, whose space is laid into the room by `view`: `step` is called for each of its pictures, and is to
   * call `draw`. who: the person out of whose eyes it is, whose head is not drawn. Raises where the headset cannot. */
  async present(session: XRSession, view: Group, who: string, step: (now: number, frame: XRFrame) => void): Promise<XRReferenceSpace> {
    const { xr } = this.renderer;
    xr.enabled = true;
    xr.setReferenceSpaceType("local");
    await xr.setSession(session);
    view.add(this.camera);
    this.scene.add(view);
    [this.worn, this.looksOutOf] = [view, who];
    this.camera.near = WORN_NEAR_M;
    this.renderer.setAnimationLoop((now, frame) => frame && step(now, frame));
    return xr.getReferenceSpace()!;
  }

  /** The headset's session has ended: the page's picture is drawn again. */
  presentNoMore(): void {
    this.renderer.setAnimationLoop(null);
    this.renderer.xr.enabled = false;
    this.worn?.remove(this.camera);
    this.worn?.removeFromParent();
    this.figures.get(this.looksOutOf)?.behead(false);
    [this.worn, this.looksOutOf] = [null, ""];
    requestAnimationFrame(() => this.resize()); // while the session ends, it cannot be
  }

  /** From now on full sharpness, however long pictures take: for stills. */
  sharp(): void {
    this.fixed = true;
    this.sharpen(1);
  }

  /** Who or what is at a place of the canvas (-1 to 1, up), with its name, and where it was hit; but: not this person. */
  pick(x: number, y: number, but = ""): Picked | null {
    const ray = new Raycaster();
    ray.setFromCamera(new Vector2(x, y), this.camera);
    let best = Infinity;
    let found: Picked | null = null;
    for (const [id, { node }] of this.things) {
      const hit = ray.intersectObject(node, true)[0];
      if (hit && hit.distance < best) [best, found] = [hit.distance, { thing: id, at: hit.point }];
    }
    const on = new Vector3();
    for (const [person, figure] of this.figures) {
      if (person === but) continue;
      for (const place of figure.places()) {
        const joint = new Vector3(...place);
        ray.ray.closestPointToPoint(joint, on);
        const distance = on.distanceTo(ray.ray.origin);
        if (on.distanceTo(joint) >= NEAR_M || distance >= best - 0.1) continue;
        [best, found] = [distance, { person, at: ray.ray.at(distance - SKIN_M, new Vector3()) }];
      }
    }
    return found;
  }

  change(): void {
    this.fresh = false;
    this.changed?.();
  }

  /** For how long somebody moves from one frame to the next [ms]: where pictures are slower than frames, the newest one is shown as it is. */
  private get overMs(): number {
    return this.took < FRAME_MS ? FRAME_MS : 0;
  }

  private pose(shown: Map<string, Figure>, frame: Frame, table: Pick<Table, "people">, now: number): void {
    for (const person of frame.people) {
      const about = table.people[person.who];
      if (!about || !shown.get(about.name)?.receive(person, now)) continue;
      this.movedAt = now;
      this.change();
    }
  }

  private cameraMoved(): boolean {
    this.camera.updateMatrixWorld();
    const moved = apart(this.camera.matrixWorld, this.from) || apart(this.camera.projectionMatrix, this.through);
    this.from.copy(this.camera.matrixWorld);
    this.through.copy(this.camera.projectionMatrix);
    return moved;
  }

  private showPeople(shown: Map<string, Figure>, table: Pick<Table, "people">, joints: Joints, ghosts: boolean): void {
    this.keepOnly(shown, new Set(table.people.map((p) => p.name)), (f) => f.remove());
    for (const about of table.people) {
      const known = shown.get(about.name);
      if (known && (known.about.file === about.file || !about.file)) {
        known.about = { ...about, file: known.about.file };
        continue;
      }
      const figure = known ?? new Figure(about, joints, ghosts);
      figure.about = about;
      shown.set(about.name, figure);
      this.scene.add(figure.root);
      if (about.file) void this.dress(figure, about, about.file);
    }
  }

  /** Have somebody put on their own figure. Where the processor draws, the first picture of one takes seconds: the room as it is without
   * it is seen before. */
  private async dress(figure: Figure, about: PersonRow, digest: string): Promise<void> {
    const ready = async () => {
      await this.nextPicture();
      return figure.root.parent !== null && figure.about.file === digest;
    };
    try {
      await this.files.takeInTurn(digest, ready, (scene) => figure.wear(scene));
      this.contacts.show(this.figures);
    } catch {
      figure.about = { ...about, file: null };
    }
    this.change();
  }

  private nextPicture(): Promise<void> {
    return new Promise((done) => {
      this.waiting.push(done);
      this.change();
    });
  }

  /** Of which kinds the picture that has just been asked for is the first: "room" with walls and everybody, if only as stand-ins;
   * "figures" with everybody's own figure. */
  private first(): string[] {
    const people = [...this.figures.values()];
    if (this.firsts.has("figures") || !this.walls || !people.length || !people.every((f) => f.root.visible)) return [];
    const now = (people.every((f) => f.own) ? ["room", "figures"] : ["room"]).filter((name) => !this.firsts.has(name));
    for (const name of now) this.firsts.add(name);
    return now;
  }

  /** Find out when the picture that has just been asked for is there: drawing goes on after this thread has said what to draw. tMs: of
   * what conference time it is, where that is to be told; first: how it is marked in the browser's own list of times (User Timing). */
  private lookAfter(tMs: number | null, first: string[]): void {
    const gl = this.renderer.getContext() as WebGL2RenderingContext;
    const drawn = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
    if (!drawn) return; // the context is lost
    gl.flush();
    this.unfinished++;
    const waiting = tMs === null ? [] : this.waiting.splice(0);
    const look = () => {
      if (gl.isContextLost()) {
        this.unfinished = 0;
        return void this.waiting.push(...waiting);
      }
      if (gl.getSyncParameter(drawn, gl.SYNC_STATUS) !== gl.SIGNALED) return void setTimeout(look, LOOK_MS);
      gl.deleteSync(drawn);
      this.unfinished = Math.max(0, this.unfinished - 1);
      for (const name of first) performance.mark(name);
      for (const go of waiting) go();
      if (tMs !== null) this.seen?.(tMs, performance.now());
    };
    setTimeout(look, LOOK_MS);
  }

  private async showThing(about: ThingRow): Promise<void> {
    const known = this.things.get(about.id);
    if (known && (known.about.file === about.file || !about.file)) return;
    const node = known?.node ?? new Group();
    this.things.set(about.id, { about, node });
    if (!known) {
      node.visible = false;
      this.scene.add(node);
    }
    if (!about.file) return;
    const scene = await this.files.take(about.file);
    if (this.things.get(about.id)?.about.file !== about.file) return dispose(scene);
    for (const child of [...node.children]) if (child.name !== INK) this.drop(child as Group);
    for (const child of scene.children) {
      child.position.set(0, 0, 0);
      child.quaternion.identity();
    }
    scene.traverse((part) => {
      if (!(part instanceof Mesh)) return;
      part.castShadow = part.receiveShadow = true;
      if (part.material instanceof MeshBasicMaterial) this.shine(part.material);
    });
    node.add(scene);
    this.dents.wear(about.id, about.file, scene);
    this.screens.show(this.things);
    this.change();
  }

  /** A page of a panel: as a screen is seen, its letters sharp from the side, too. */
  private shine(page: MeshBasicMaterial): void {
    page.toneMapped = false;
    page.color.setScalar(PAGE);
    if (page.map) page.map.anisotropy = this.renderer.capabilities.getMaxAnisotropy();
  }

  private showShell(digest: string): Promise<void> {
    return this.files.takeInTurn(digest, async () => this.shell === digest, (scene) => this.putShell(scene));
  }

  private putShell(scene: Group): void {
    const meshes: Mesh[] = [];
    scene.traverse((part) => part instanceof Mesh && meshes.push(part));
    for (const mesh of meshes) {
      if (mesh.material instanceof MeshBasicMaterial) mesh.material.toneMapped = false;
      else mesh.castShadow = mesh.receiveShadow = true;
      if (!mesh.name.startsWith("shadowed")) continue;
      mesh.castShadow = true;
      const shade = new ShadowMaterial({ opacity: SHADOW, side: DoubleSide, polygonOffset: true, polygonOffsetFactor: -1 });
      const over = new Mesh(mesh.geometry, shade);
      over.receiveShadow = true;
      mesh.add(over);
    }
    this.scene.add(scene);
    this.walls = true;
    this.change();
  }

  private resize(): void {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (!width || !height || this.renderer.xr.isPresenting) return;
    this.renderer.setPixelRatio(Math.min(2, devicePixelRatio) * this.sharpness);
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.change();
  }

  /** Coarser where pictures take too long, at last without shadows that move. */
  private adapt(now: number): void {
    const took = Math.min(500, now - this.last);
    this.last = now;
    if (!this.went && !this.worn) return; // nothing was drawn meanwhile, because nothing moved
    this.took += (took - this.took) / 12;
    this.picturesPerS = 1000 / this.took;
    if (this.fixed || this.worn) return;
    if (this.took > SLOW_MS && this.sharpness > COARSEST) this.sharpen(Math.max(COARSEST, this.sharpness * 0.8));
    else if (this.took < QUICK_MS && this.sharpness < 1) this.sharpen(Math.min(1, this.sharpness * 1.25));
  }

  private sharpen(sharpness: number): void {
    this.sharpness = sharpness;
    this.took = FRAME_MS;
    const side = this.sharpness < COARSE ? 512 : 2048;
    if (this.key.shadow.mapSize.x !== side) {
      this.key.shadow.mapSize.set(side, side);
      this.key.shadow.map?.dispose();
      this.key.shadow.map = null;
    }
    this.resize();
  }

  private keepOnly<T>(all: Map<string, T>, wanted: Set<string>, remove: (one: T) => void): void {
    for (const [name, one] of all) {
      if (wanted.has(name)) continue;
      remove(one);
      all.delete(name);
    }
  }

  private drop(node: Group): void {
    node.removeFromParent();
    dispose(node);
  }
}

function alike(node: Group, { position, rotation }: Frame["things"][number]): boolean {
  const now = [...node.position.toArray(), ...node.quaternion.toArray()];
  return [...position, ...rotation].every((value, n) => value === now[n]);
}

function apart(a: Matrix4, b: Matrix4): boolean {
  return a.elements.some((value, n) => Math.abs(value - b.elements[n]!) > STILL);
}
