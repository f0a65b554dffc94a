// Where the guest's headset is in the room: its own space is laid so that they look out of their figure's eyes, ahead; and it turns in
// steps, since a chair at home does not turn as the one in the room.
import { Euler, Group, Matrix4, Quaternion, Vector3 } from "three";
import type { Eyes } from "./eyes";

const STEP = Math.PI / 6; // with one push of a thumbstick
const MOST_STEPS = 3; // to a side: as far as somebody on a chair can turn, so that the figure can
const UP = new Vector3(0, 1, 0);

export class SeatView extends Group {
  private steps = 0;

  constructor(private readonly eyes: Eyes) {
    super();
  }

  /** From now on the head is where the figure's is at rest, and looks ahead; head: its pose in the headset's space. */
  centre(head: XRRigidTransform): void {
    this.steps = 0;
    const looks = new Euler().setFromQuaternion(quaternionOf(head), "YXZ").y;
    this.place(head, this.eyes.home(), this.eyes.heading + Math.PI - looks);
  }

  /** Turn about the head, to the left or the right (1, -1). */
  turn(way: number, head: XRRigidTransform): void {
    const steps = Math.min(MOST_STEPS, Math.max(-MOST_STEPS, this.steps + way));
    const by = (steps - this.steps) * STEP;
    this.steps = steps;
    this.place(head, this.inRoom(head), new Euler().setFromQuaternion(this.quaternion, "YXZ").y + by);
  }

  /** Where a pose of the headset's space is in the room [m]. */
  inRoom(pose: XRRigidTransform): Vector3 {
    return vectorOf(pose).applyMatrix4(this.matrixWorld);
  }

  /** A point before the face of a head, in the room [m]. */
  before(head: XRRigidTransform): Vector3 {
    return new Vector3(0, 0, -1).applyQuaternion(quaternionOf(head)).add(vectorOf(head)).applyMatrix4(this.matrixWorld);
  }

  /** A pose of the headset's space in the seat's frame. */
  inSeat(pose: XRRigidTransform): { place: number[]; turn: number[] } {
    const place = this.eyes.intoSeat(this.inRoom(pose)).toArray();
    const turn = new Quaternion().setFromAxisAngle(UP, -this.eyes.heading).multiply(this.quaternion).multiply(quaternionOf(pose));
    return { place, turn: turn.toArray() };
  }

  private place(head: XRRigidTransform, at: Vector3, yaw: number): void {
    this.quaternion.setFromAxisAngle(UP, yaw);
    this.position.copy(at).sub(vectorOf(head).applyMatrix4(new Matrix4().makeRotationFromQuaternion(this.quaternion)));
    this.updateMatrixWorld(true);
  }
}

function vectorOf({ position: p }: XRRigidTransform): Vector3 {
  return new Vector3(p.x, p.y, p.z);
}

function quaternionOf({ orientation: q }: XRRigidTransform): Quaternion {
  return new Quaternion(q.x, q.y, q.z, q.w);
}
