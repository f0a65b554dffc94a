// The guest's phone as a wand: its sensors say how it is turned, and the hand is where an arm is that points so. Said in the words of
// a headset with one controller, so that figure and grasp are solved as for these.
import { Euler, Matrix4, Quaternion, Vector3 } from "three";
import type { Link } from "../connection/link";
import type { Eyes } from "./eyes";
import { PoseSender, SEND_MS } from "./pose_sender";
import type { Controller } from "./poses";
import { text } from "./words";

/** What a person is told. insecure: the page has no https; none: nothing to turn; still: the sensors say nothing. */
type State = "none" | "insecure" | "off" | "asking" | "on" | "still" | "refused";
const STILL_MS = 3000; // without a first word of the sensors for so long, there are none; later they are silent while it lies still
const RAD = Math.PI / 180;
const ARM = new Vector3(-0.2, -0.28, 0.06); // from between the eyes to where the arm turns, in the seat's frame [m]
const REACH_M = 0.5; // from there to the hand at first
const NEAREST_M = 0.28;
const FARTHEST_M = 0.72;
const SLID_M = 0.6; // nearer or farther with a finger's way over the height of the picture
const LOWEST_M = 0.5; // above the floor: no hand goes through the seat
const FOLLOWS = 0.7; // share of the way to the hand by which the head turns to it: on an upright phone, too, the hand is in sight
const MOST_YAW = 1.2; // of the head [rad]
const MOST_PITCH = 0.7;
const TURNED = 0.003; // the head turns from so much on: a phone at rest costs no picture [rad]
const UNSURE = 0.5; // confidence in a place that is guessed

type Orientation = Pick<DeviceOrientationEvent, "alpha" | "beta" | "gamma">;
/** Of a phone: where its top points, and its screen and its right edge face; (east, north, up). */
interface Axes {
  top: Vector3;
  screen: Vector3;
  right: Vector3;
}

export class Wand {
  state: State = "none";
  private readonly sender: PoseSender;
  private ahead: Vector3 | null = null; // where the phone pointed when it became a wand, level
  private newest: Axes | null = null;
  private openedAt = 0;
  private reach = REACH_M;
  private pressed = false;
  private slid = 0; // where the finger was, of the picture's height
  private timer = 0;
  private looked: [number, number] = [0, 0]; // where the head was turned last [rad]

  /** changed: the state is another; looks: where the guest's own head turns to, from where the seat faces [rad]. */
  constructor(
    link: () => Link,
    private readonly eyes: () => Eyes | null,
    private readonly changed: () => void,
    private readonly looks: (yaw: number, pitch: number) => void,
  ) {
    this.sender = new PoseSender(link);
    if ("DeviceOrientationEvent" in window && matchMedia("(pointer: coarse)").matches) this.state = isSecureContext ? "off" : "insecure";
    document.addEventListener("visibilitychange", () => document.hidden && this.on && this.unheld());
  }

  /** Bytes. */
  get sent(): number {
    return this.sender.sent;
  }

  /** Whether it leads the hand. */
  get on(): boolean {
    return this.state === "on" || this.state === "still";
  }

  /** To be called where somebody has touched the page: some browsers ask then. */
  async open(): Promise<void> {
    this.become("asking");
    const asks = DeviceOrientationEvent as unknown as { requestPermission?: () => Promise<string> };
    const answer = await asks.requestPermission?.().catch(() => "denied");
    if (answer !== undefined && answer !== "granted") return this.become("refused");
    [this.ahead, this.newest, this.reach, this.openedAt] = [null, null, REACH_M, performance.now()];
    addEventListener("deviceorientation", this.turned);
    this.timer = setInterval(() => this.tell(), SEND_MS);
    this.become("on");
  }

  close(): void {
    if (!this.on) return;
    removeEventListener("deviceorientation", this.turned);
    clearInterval(this.timer);
    this.become("off");
    this.unheld();
  }

  /** Where it points now is ahead. */
  centre(): void {
    this.ahead = this.newest && level(this.newest);
  }

  /** A finger lies on the picture; y: how high, of the picture's height. */
  press(y: number): void {
    [this.pressed, this.slid] = [true, y];
  }

  /** It slides: up is farther. */
  slide(y: number): void {
    if (!this.pressed) return;
    this.reach = Math.min(FARTHEST_M, Math.max(NEAREST_M, this.reach + SLID_M * (y - this.slid)));
    this.slid = y;
  }

  release(): void {
    this.pressed = false;
  }

  private readonly turned = (event: DeviceOrientationEvent): void => {
    const axes = axesOf(event);
    if (!axes) return;
    this.newest = axes;
    this.ahead ??= level(axes);
    if (this.state === "still") this.become("on");
  };

  private tell(): void {
    const eyes = this.eyes();
    if (document.hidden || !eyes) return;
    if (!this.newest && this.state === "on" && performance.now() - this.openedAt > STILL_MS) this.become("still");
    if (!this.newest || !this.ahead) return;
    const [top, screen, right] = [this.newest.top, this.newest.screen, this.newest.right].map((way) => intoSeat(way, this.ahead!)) as [
      Vector3,
      Vector3,
      Vector3,
    ];
    const home = eyes.intoSeat(eyes.home());
    const at = home.clone().add(ARM).addScaledVector(top, this.reach);
    at.y = Math.max(LOWEST_M, at.y);
    // Fingers along the phone, the palm to its left: so is a hand along the -Y and -X of WebXR's grip space.
    const turn = new Quaternion().setFromRotationMatrix(new Matrix4().makeBasis(right, top.clone().negate(), screen.clone().negate()));
    const closed = this.pressed ? 1 : 0; // the trigger bends the index finger, the squeeze the others
    const grip: Controller = { place: at.toArray(), turn: turn.toArray(), trigger: closed, squeeze: closed, confidence: UNSURE };
    const way = at.clone().sub(home);
    const yaw = within(FOLLOWS * Math.atan2(way.x, way.z), MOST_YAW);
    const pitch = within(FOLLOWS * Math.atan2(way.y, Math.hypot(way.x, way.z)), MOST_PITCH);
    if (Math.hypot(yaw - this.looked[0], pitch - this.looked[1]) > TURNED) this.looks(...(this.looked = [yaw, pitch]));
    const looking = new Quaternion().setFromEuler(new Euler(pitch, yaw + Math.PI, 0, "YXZ"));
    this.sender.say({ place: home.toArray(), turn: looking.toArray(), confidence: UNSURE }, null, grip);
  }

  private unheld(): void {
    this.sender.sayNobody(() => this.state !== "on" || document.hidden);
  }

  private become(state: State): void {
    this.state = state;
    this.changed();
  }
}

/** Of the angles of W3C's DeviceOrientation, about Z, then X, then Y; null: the device has no such sensors. */
function axesOf({ alpha, beta, gamma }: Orientation): Axes | null {
  if (alpha === null || beta === null || gamma === null) return null;
  const turn = new Quaternion()
    .setFromAxisAngle(new Vector3(0, 0, 1), alpha * RAD)
    .multiply(new Quaternion().setFromAxisAngle(new Vector3(1, 0, 0), beta * RAD))
    .multiply(new Quaternion().setFromAxisAngle(new Vector3(0, 1, 0), gamma * RAD));
  const of = (x: number, y: number, z: number) => new Vector3(x, y, z).applyQuaternion(turn);
  return { right: of(1, 0, 0), top: of(0, 1, 0), screen: of(0, 0, 1) };
}

/** Where somebody faces who holds it before them, lying or upright: level, of length 1. */
function level({ top, screen }: Axes): Vector3 {
  return top.clone().sub(screen).setZ(0).normalize();
}

/** A direction (east, north, up) in the seat's frame, whose +Z is `ahead`. */
function intoSeat(way: Vector3, ahead: Vector3): Vector3 {
  const left = new Vector3(-ahead.y, ahead.x, 0);
  return new Vector3(way.dot(left), way.z, way.dot(ahead));
}

function within(x: number, most: number): number {
  return Math.min(most, Math.max(-most, x));
}

/** The button that makes the phone a wand, and a phone again; a line where the page cannot. */
export function WandButton({ wand }: { wand: Wand }) {
  const { state, on } = wand;
  if (state === "none") return null;
  if (state === "insecure") return <span>{text("wand_insecure")}</span>;
  return (
    <>
      <button type="button" id="wand" aria-pressed={on} disabled={state === "asking"} onClick={() => (on ? wand.close() : void wand.open())}>
        {text(`wand_${state}`)}
      </button>
      {on && <button type="button" id="wand-centre" onClick={() => wand.centre()}>{text("wand_centre")}</button>}
    </>
  );
}
