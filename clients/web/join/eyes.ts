// The guest's own eyes: the room from where their figure's are, turned by dragging and by keys at once, without waiting for it.
import { Euler, Quaternion, Vector3 } from "three";
import type { Room } from "../console/room";
import { MOST_PITCH, MOST_YAW } from "./record";

const FIELD_DEG = 68; // of view, upright
const NEAR_M = 0.12; // own hair and lashes are not in the picture
const OUT_OF_HEAD_M = 0.1;
const ABOVE_SEAT_M = 1.2; // eyes of somebody who sits, until the figure is there
const STEADY = 0.12; // share of the way to the figure's eyes that each picture takes: it breathes, the view does not shake
const BEGIN_PITCH = -0.32; // at the table and at who sits there [rad]
const TURN = Math.PI / 36; // with one press of a key
const KEYS: Record<string, [number, number]> = { ArrowLeft: [1, 0], ArrowRight: [-1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };

/** seat: x, y, z on the floor under it [m], and its heading about +Y from +Z [rad]. */
export type Seat = [number, number, number, number];

export class Eyes {
  yaw = 0; // from where the seat faces, left positive [rad]
  pitch = BEGIN_PITCH;
  private readonly at: Vector3;
  private found = false;
  private rest: Vector3 | null = null;
  /** The floor under the seat. */
  readonly origin: Vector3;

  constructor(
    private readonly room: Room,
    readonly who: string,
    private readonly seat: Seat,
  ) {
    this.open();
    this.origin = new Vector3(seat[0], seat[1], seat[2]);
    this.at = this.origin.clone().add(new Vector3(0, ABOVE_SEAT_M, 0));
  }

  /** See by the page's picture, as a headset that was worn may have left it. */
  open(): void {
    const { camera } = this.room;
    [camera.fov, camera.near, camera.zoom] = [FIELD_DEG, NEAR_M, 1];
    camera.scale.set(1, 1, 1);
    camera.updateProjectionMatrix();
  }

  /** Where the seat faces, about +Y from +Z [rad]. */
  get heading(): number {
    return this.seat[3];
  }

  /** Midway between the figure's eyes while it rests: where they were when it was first seen. */
  home(): Vector3 {
    this.rest ??= this.between();
    return this.rest?.clone() ?? this.origin.clone().add(new Vector3(0, ABOVE_SEAT_M, 0));
  }

  /** Turn by what was dragged [canvas heights]. */
  drag(x: number, y: number): void {
    const field = (FIELD_DEG * Math.PI) / 180;
    this.turn(x * field, y * field);
  }

  /** Whether a key turned the view. */
  key(key: string): boolean {
    const turn = KEYS[key];
    if (turn) this.turn(turn[0] * TURN, turn[1] * TURN);
    return turn !== undefined;
  }

  step(): void {
    const turned = new Quaternion().setFromEuler(new Euler(this.pitch, this.seat[3] + this.yaw + Math.PI, 0, "YXZ"));
    const middle = this.between();
    if (middle) {
      this.rest ??= middle.clone();
      middle.add(new Vector3(0, 0, -OUT_OF_HEAD_M).applyQuaternion(turned));
      this.at.lerp(middle, this.found ? STEADY : 1);
      this.found = true;
    }
    this.room.camera.position.copy(this.at);
    this.room.camera.quaternion.copy(turned);
    this.room.camera.updateMatrixWorld();
  }

  /** Where a point of the room is from here, as a head would turn to it: yaw and pitch from where the seat faces [rad]. */
  towards(point: Vector3): [number, number] {
    const way = point.clone().sub(this.at);
    const yaw = Math.atan2(way.x, way.z) - this.seat[3];
    return [Math.atan2(Math.sin(yaw), Math.cos(yaw)), Math.atan2(way.y, Math.hypot(way.x, way.z))];
  }

  /** A point of the room in the seat's frame. */
  intoSeat(point: Vector3): Vector3 {
    return point.clone().sub(this.origin).applyAxisAngle(new Vector3(0, 1, 0), -this.seat[3]);
  }

  /** Midway between the eyes of the guest's figure; null: it is not there yet. */
  private between(): Vector3 | null {
    const figure = this.room.figures.get(this.who);
    if (!figure?.root.visible) return null;
    const middle = new Vector3();
    for (const eye of ["left_eye", "right_eye"]) middle.addScaledVector(figure.joint(eye).getWorldPosition(new Vector3()), 0.5);
    return middle;
  }

  private turn(yaw: number, pitch: number): void {
    this.yaw = Math.min(MOST_YAW, Math.max(-MOST_YAW, this.yaw + yaw));
    this.pitch = Math.min(MOST_PITCH, Math.max(-MOST_PITCH, this.pitch + pitch));
  }
}
