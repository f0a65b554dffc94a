// From where the room is looked at: round it, down on the table, or through somebody's eyes.
import { type PerspectiveCamera, Quaternion, Spherical, Vector3 } from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import type { Room } from "./room";

const ROUND = { from: new Vector3(0.62, 1.66, 2.3), to: new Vector3(0, 0.82, 0.05) }; // as the renderers' overview
const TABLE = { from: new Vector3(0.01, 2.75, 0.75), to: new Vector3(0, 0.72, 0) };
const WALL_M = 3.9; // the walls are at 4.05
const CEILING_M = 2.85;
const TURN = Math.PI / 24; // with one press of a key
const NARROW = 1.2; // a picture narrower than this is looked at from farther away
const OUT_OF_HEAD_M = 0.09; // before the eyes, so that no lashes and hair are in the way
const HALF_TURN = new Quaternion(0, 1, 0, 0); // cameras look along -Z, heads along +Z

export type View = "round" | "table" | string; // or the name of whose eyes it is

export class Looking {
  private view: View = "round";
  private readonly controls: OrbitControls;

  constructor(
    private readonly room: Room,
    private readonly changed: (view: View) => void,
  ) {
    const controls = (this.controls = new OrbitControls(room.camera, room.canvas));
    controls.enableDamping = true;
    controls.minDistance = 0.3;
    controls.maxDistance = 6;
    controls.maxPolarAngle = Math.PI * 0.55;
    room.canvas.addEventListener("keydown", (event) => this.key(event));
    this.choose("round");
  }

  choose(view: View): void {
    this.view = view;
    const eyes = view !== "round" && view !== "table";
    this.controls.enabled = !eyes;
    this.room.camera.near = eyes ? 0.06 : 0.03;
    this.room.camera.fov = eyes ? 62 : 45;
    if (!eyes) {
      const { from, to } = view === "table" ? TABLE : ROUND;
      const farther = Math.max(1, NARROW / this.room.camera.aspect);
      this.controls.target.copy(to);
      this.room.camera.position.copy(to).addScaledVector(from.clone().sub(to), Math.min(1.6, farther));
    }
    this.room.camera.updateProjectionMatrix();
    this.changed(view);
  }

  step(): void {
    const figure = this.room.figures.get(this.view);
    if (figure) return through(this.room.camera, figure.joint("left_eye"), figure.joint("right_eye"), figure.joint("head"));
    if (!this.controls.enabled) return this.choose("round"); // who lent their eyes has left
    this.controls.update();
    const at = this.room.camera.position;
    at.set(clamp(at.x, WALL_M), Math.min(CEILING_M, Math.max(0.1, at.y)), clamp(at.z, WALL_M));
  }

  private key(event: KeyboardEvent): void {
    const turns: Record<string, [number, number, number]> = {
      ArrowLeft: [-TURN, 0, 1],
      ArrowRight: [TURN, 0, 1],
      ArrowUp: [0, -TURN, 1],
      ArrowDown: [0, TURN, 1],
      "+": [0, 0, 0.9],
      "=": [0, 0, 0.9],
      "-": [0, 0, 1.1],
    };
    const turn = turns[event.key];
    if (!turn || !this.controls.enabled) return;
    event.preventDefault();
    const { camera } = this.room;
    const place = new Spherical().setFromVector3(camera.position.clone().sub(this.controls.target));
    place.theta += turn[0];
    place.phi = Math.min(this.controls.maxPolarAngle, Math.max(0.05, place.phi + turn[1]));
    place.radius = Math.min(this.controls.maxDistance, Math.max(this.controls.minDistance, place.radius * turn[2]));
    camera.position.setFromSpherical(place).add(this.controls.target);
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

function clamp(x: number, most: number): number {
  return Math.min(most, Math.max(-most, x));
}
