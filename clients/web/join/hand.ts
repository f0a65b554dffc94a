// The hand that a pressed pointer leads: to what was pressed, and from there as the pointer moves and the wheel is turned. That the
// view moves, as the guest's figure leans after its hand, leads it nowhere.
import { Box3, type Object3D, Raycaster, Vector2, Vector3 } from "three";
import type { Room } from "../console/room";
import type { Eyes } from "./eyes";
import type { Pointed } from "./record";

const STEP_M = 0.02; // nearer or farther with one notch of the wheel
const NEAREST_M = 0.2;
const FARTHEST_M = 1.5;
const LONG = 1.4; // a thing so many times as long as wide is taken across its length
const UPRIGHT = 0.8; // of a thing whose length stands so nearly upright the palm lies across nothing
const SMALL_M = 0.14; // a thing no larger is taken at its middle, wherever it is pressed...
const BEYOND_M = 0.03; // ... by a palm that goes so far past it, as fingers close on the way, ...
const OVER_M = 0.01; // ... and so far over it
const LEFT_FROM_M = 0.05; // what is farther to the left is taken with the left hand

export class Hand {
  private readonly place = new Vector3(); // where it is led
  private readonly pointer = new Vector2(); // where the pointer was when it was led there
  private side: "left" | "right" = "right";
  private turn: number | null = null;
  private closes = false;
  private pressed = false;

  constructor(
    private readonly room: Room,
    private readonly eyes: Eyes,
    private readonly who: string,
  ) {}

  /** The pointer was pressed at a place of the canvas (-1 to 1, up). False where there is nothing to reach for. */
  press(x: number, y: number): boolean {
    const found = this.room.pick(x, y, this.who);
    if (!found) return false;
    const thing = found.thing === undefined ? undefined : this.room.things.get(found.thing);
    this.place.copy((thing && this.round(thing.node)) ?? found.at);
    this.pointer.set(x, y);
    this.side = this.eyes.intoSeat(this.place).x > LEFT_FROM_M ? "left" : "right";
    this.closes = thing !== undefined;
    this.turn = thing ? this.across(thing.node) : null;
    this.pressed = true;
    return true;
  }

  release(): void {
    this.pressed = false;
  }

  /** The wheel was turned; notches: away from who turns it is negative, as browsers count. */
  wheel(notches: number): void {
    const depth = this.depth();
    this.place.addScaledVector(this.ahead(), Math.min(FARTHEST_M, Math.max(NEAREST_M, depth - STEP_M * notches)) - depth);
  }

  /** Where each hand is led, with the pointer at a place of the canvas. */
  led(x: number, y: number): { left: Pointed | null; right: Pointed | null } {
    if (!this.pressed) return { left: null, right: null };
    const now = new Vector2(x, y);
    const depth = this.depth();
    this.place.add(this.under(now, depth).sub(this.under(this.pointer, depth)));
    this.pointer.copy(now);
    const palm = this.eyes.intoSeat(this.place).toArray();
    const hand: Pointed = { palm, turn: this.turn, close: this.closes };
    return { left: this.side === "left" ? hand : null, right: this.side === "right" ? hand : null };
  }

  /** What is under the pointer, so far ahead [m]. */
  private under(pointer: Vector2, depth: number): Vector3 {
    const ray = new Raycaster();
    ray.setFromCamera(pointer, this.room.camera);
    return ray.ray.at(depth / Math.max(0.1, ray.ray.direction.dot(this.ahead())), new Vector3());
  }

  /** How far ahead the place is [m]. */
  private depth(): number {
    return this.place.clone().sub(this.room.camera.position).dot(this.ahead());
  }

  private ahead(): Vector3 {
    return new Vector3(0, 0, -1).applyQuaternion(this.room.camera.quaternion);
  }

  /** Where a palm takes a thing that a hand goes round; null: it is larger. */
  private round(node: Object3D): Vector3 | null {
    const box = new Box3().setFromObject(node);
    const size = box.getSize(new Vector3());
    if (Math.max(size.x, size.y, size.z) > SMALL_M) return null;
    const middle = box.getCenter(new Vector3());
    const away = middle.clone().sub(this.room.camera.position).setY(0).normalize();
    return middle.addScaledVector(away, BEYOND_M).add(new Vector3(0, OVER_M, 0));
  }

  /** How a long thing lies, about +Y in the seat's frame; null for others. */
  private across(node: Object3D): number | null {
    const turned = node.quaternion.clone();
    const place = node.position.clone();
    node.quaternion.identity();
    node.position.set(0, 0, 0);
    node.updateMatrixWorld(true);
    const size = new Box3().setFromObject(node).getSize(new Vector3());
    node.quaternion.copy(turned);
    node.position.copy(place);
    node.updateMatrixWorld(true);
    const sizes = size.toArray().map((length, axis) => ({ length, axis }));
    const [first, second] = sizes.sort((a, b) => b.length - a.length);
    if (!first || !second || first.length < LONG * second.length) return null;
    const way = new Vector3().setComponent(first.axis, 1).applyQuaternion(turned);
    if (Math.abs(way.y) > UPRIGHT) return null;
    const inSeat = this.eyes.intoSeat(way.add(this.eyes.origin));
    return Math.atan2(-inSeat.z, inSeat.x);
  }
}
