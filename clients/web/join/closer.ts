// A board or a panel as if the guest stood before it: to read what is too small from their seat.
import { Matrix4, type PerspectiveCamera, Vector3 } from "three";
import { type FrontInRoom, frontInRoom } from "../console/fronts";
import type { Room } from "../console/room";

const KEY = "L";
const BEFORE_M = 0.02; // the picture ends so far beyond its edges

export class Closer {
  private thing: string | null = null;

  constructor(private readonly room: Room) {}

  /** Where what is looked at closer is [m]; null: nothing is, or it has gone. */
  get at(): Vector3 | null {
    return this.front?.centre ?? null;
  }

  /** Look at what is read at a place of the canvas (-1 to 1, up); back to the seat where something is looked at already. Whether the
   * view is another. */
  turn(x: number, y: number): boolean {
    if (this.back()) return true;
    const found = this.room.pick(x, y)?.thing;
    if (!found || !this.room.things.get(found)?.about.front) return false;
    this.thing = found;
    return true;
  }

  /** Whether a key brought another view: L looks at what is nearest to where the guest looks, also where that is beside the picture; L
   * and Escape go back. */
  press(key: string): boolean {
    if (key === "Escape" || (key.toUpperCase() === KEY && this.at)) return this.back();
    if (key.toUpperCase() !== KEY) return false;
    const { camera } = this.room;
    const ahead = camera.getWorldDirection(new Vector3());
    let most = -Infinity;
    for (const [id, { about, node }] of this.room.things) {
      if (!about.front || !node.visible) continue;
      const towards = frontInRoom(about.front, node).centre.sub(camera.position).normalize().dot(ahead);
      if (towards > most) [most, this.thing] = [towards, id];
    }
    return this.thing !== null;
  }

  /** Put the camera before it; it stays where it is where nothing is looked at. */
  step(camera: PerspectiveCamera): void {
    const { front } = this;
    if (!front) return void (this.thing = null);
    const { centre, normal, up, wide, high } = front;
    const half = Math.tan((camera.fov * Math.PI) / 360);
    const far = Math.max((0.5 * high + BEFORE_M) / half, (0.5 * wide + BEFORE_M) / (half * camera.aspect));
    camera.position.copy(centre).addScaledVector(normal, far);
    camera.quaternion.setFromRotationMatrix(new Matrix4().lookAt(camera.position, centre, up));
    camera.updateMatrixWorld();
  }

  private back(): boolean {
    const was = this.at !== null;
    this.thing = null;
    return was;
  }

  private get front(): FrontInRoom | null {
    const found = this.thing === null ? undefined : this.room.things.get(this.thing);
    return found?.about.front ? frontInRoom(found.about.front, found.node) : null;
  }
}
