// From where the room is looked at: round it, down on the table, or through somebody's eyes.
import { type PerspectiveCamera, Quaternion, Vector3 } from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import { frontInRoom } from "./fronts";
import { FIELD, type Front, overview, type Place, type View as Seen } from "./overview";
import { orbitedByKey } from "./orbit_keys";
import type { Room } from "./room";

const TABLE: Seen = { from: [0.01, 2.75, 0.75], to: [0, 0.72, 0] };
const FIRST_MS = 5000; // so long after the first things who and what comes may still change from where the room is seen
const WALL_M = 3.9; // the walls are at 4.05
const CEILING_M = 2.85;
const NARROW = 1.2; // a picture narrower than this is looked at from farther away
const OUT_OF_HEAD_M = 0.09; // before the eyes, so that no lashes and hair are in the way
const HALF_TURN = new Quaternion(0, 1, 0, 0); // cameras look along -Z, heads along +Z

export type View = "round" | "table" | string; // or the name of whose eyes it is

export class Looking {
  private view: View = "round";
  private readonly controls: OrbitControls;
  private chosen = false; // somebody has: what comes into the room changes nothing any more
  private there = ""; // who and what has been found a view for
  private firstAt = 0; // when the first things were there

  constructor(
    private readonly room: Room,
    private readonly changed: (view: View) => void,
  ) {
    const controls = (this.controls = new OrbitControls(room.camera, room.canvas));
    controls.enableDamping = true;
    controls.minDistance = 0.3;
    controls.maxDistance = 6;
    controls.maxPolarAngle = Math.PI * 0.55;
    controls.addEventListener("start", () => (this.chosen = true));
    controls.addEventListener("change", () => room.changed?.());
    room.canvas.addEventListener("wheel", () => (this.chosen = true), { passive: true });
    room.canvas.addEventListener("keydown", (event) => this.key(event));
    this.show("round");
  }

  choose(view: View): void {
    this.chosen = true;
    this.show(view);
  }

  private show(view: View): void {
    this.view = view;
    const eyes = view !== "round" && view !== "table";
    this.controls.enabled = !eyes;
    this.room.camera.near = eyes ? 0.06 : 0.03;
    this.room.camera.fov = eyes ? 62 : FIELD;
    if (!eyes) {
      const farther = Math.min(1.6, Math.max(1, NARROW / this.room.camera.aspect));
      const { from, to } = view === "table" ? TABLE : this.round(farther);
      const target = this.controls.target.set(...to);
      this.room.camera.position.set(...from);
      if (view === "table") this.room.camera.position.sub(target).multiplyScalar(farther).add(target);
    }
    this.room.camera.updateProjectionMatrix();
    this.room.changed?.();
    this.changed(view);
  }

  step(): void {
    const figure = this.room.figures.get(this.view);
    if (figure) return through(this.room.camera, figure.joint("left_eye"), figure.joint("right_eye"), figure.joint("head"));
    if (!this.controls.enabled) return this.show("round"); // who lent their eyes has left
    this.meet();
    this.controls.update();
    const at = this.room.camera.position;
    at.set(clamp(at.x, WALL_M), Math.min(CEILING_M, Math.max(0.1, at.y)), clamp(at.z, WALL_M));
  }

  /** The room is seen anew where somebody or a board has come, as long as nobody has chosen and it has just been opened. */
  private meet(): void {
    if (this.chosen || (this.firstAt && performance.now() - this.firstAt > FIRST_MS)) return;
    if (!this.firstAt && [...this.room.things.values()].some(({ node }) => node.visible)) this.firstAt = performance.now();
    const there = [...this.people.keys(), ...this.fronts.keys()].join("\n");
    if (!there || there === this.there) return;
    this.there = there;
    this.show("round");
  }

  private get people() {
    return new Map([...this.room.figures].filter(([, figure]) => figure.root.visible));
  }

  private get fronts() {
    return new Map([...this.room.things].filter(([, { about, node }]) => about.front && node.visible));
  }

  /** times: as far as usual, at least. */
  private round(times: number): Seen {
    const heads = [...this.people.values()].map((figure) => {
      const looks = new Vector3(0, 0, 1).applyQuaternion(figure.joint("head").getWorldQuaternion(new Quaternion()));
      return { at: placeOf(figure.overHead()), looks: placeOf(looks) };
    });
    const fronts = [...this.fronts.values()].map(({ about, node }): Front => {
      const { corners, normal } = frontInRoom(about.front!, node);
      return { corners: corners.map(placeOf), normal: placeOf(normal) };
    });
    return overview(heads, fronts, this.room.camera.aspect, times);
  }

  private key(event: KeyboardEvent): void {
    if (!orbitedByKey(event, this.room.camera, this.controls)) return;
    this.chosen = true;
    this.room.changed?.();
  }
}

function through(camera: PerspectiveCamera, ...[left, right, head]: [Placed, Placed, Placed]): void {
  const middle = left.getWorldPosition(new Vector3()).add(right.getWorldPosition(new Vector3())).multiplyScalar(0.5);
  const turned = head.getWorldQuaternion(new Quaternion());
  camera.quaternion.copy(turned).multiply(HALF_TURN);
  camera.position.copy(middle).add(new Vector3(0, 0, OUT_OF_HEAD_M).applyQuaternion(turned));
}

interface Placed {
  getWorldPosition(into: Vector3): Vector3;
  getWorldQuaternion(into: Quaternion): Quaternion;
}

function placeOf(at: Vector3): Place {
  return [at.x, at.y, at.z];
}

function clamp(x: number, most: number): number {
  return Math.min(most, Math.max(-most, x));
}
