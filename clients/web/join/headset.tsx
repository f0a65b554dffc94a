// The guest's headset (WebXR): the room in stereo from their own seat, and what it measures of them, which is sent.
import { Vector3 } from "three";
import type { Link } from "../connection/link";
import type { Room } from "../console/room";
import type { Caption, Line } from "../console/wire";
import type { Eyes } from "./eyes";
import { OwnHand } from "./own_hands";
import { PoseSender, SEND_MS } from "./pose_sender";
import type { Measured } from "./poses";
import { SeatView } from "./seat_view";
import { Said } from "./said";
import { Signs } from "./signs";
import { text } from "./words";

/** What a person is told. insecure: the page has no https; none: no headset; away: it is not worn now. */
type State = "none" | "insecure" | "off" | "asking" | "on" | "away" | "refused" | "ended";
const AWAY_MS = 2000; // without a pose of the head for so long, nobody wears it
const LOOK_MS = 250;
const PUSHED = 0.7; // of a thumbstick: it counts...
const BACK = 0.3; // ... and counts again when it was let go
const [TRIGGER, SQUEEZE, STICK] = [0, 1, 3]; // buttons of WebXR's gamepads
const STICK_X = 2;
const UNSURE = 0.5; // confidence in a pose that is guessed

export class Headset {
  state: State = "none";
  pictures = 0;
  private readonly sender: PoseSender;
  private session: XRSession | null = null;
  private view: SeatView | null = null;
  private space: XRReferenceSpace | null = null;
  private signs: Signs | null = null;
  private said: Said | null = null;
  private readonly hands = { left: new OwnHand(), right: new OwnHand() };
  private centred = false;
  private pushed = false;
  private pressed = false;
  private due = -Infinity; // when poses are sent next
  private seenAt = 0;
  private looking = 0;

  /** lines: what people have written; captions: what was said to the room; draw: what is done for each picture, at a time of `performance` [ms]; changed: the state is another; over: the page leads again. */
  constructor(
    private readonly room: Room | null,
    link: () => Link,
    private readonly eyes: () => Eyes | null,
    private readonly lines: () => Line[],
    private readonly captions: () => Caption[],
    private readonly draw: (now: number) => void,
    private readonly changed: () => void,
    private readonly over: () => void,
  ) {
    this.sender = new PoseSender(link);
    navigator.xr?.addEventListener("devicechange", () => void this.look());
    void this.look();
  }

  /** Bytes. */
  get sent(): number {
    return this.sender.sent;
  }

  /** Whether the room is drawn for it now. */
  get on(): boolean {
    return this.session !== null;
  }

  /** Find out whether there is one. */
  async look(): Promise<void> {
    if (this.on) return;
    const there = await navigator.xr?.isSessionSupported("immersive-vr").catch(() => false);
    if (!this.on) this.become(there ? "off" : isSecureContext ? "none" : "insecure");
  }

  /** Enter. To be called where somebody has clicked. */
  async open(): Promise<void> {
    const eyes = this.eyes();
    if (!this.room || !eyes || !navigator.xr) return;
    this.become("asking");
    let session: XRSession | null = null;
    try {
      session = await navigator.xr.requestSession("immersive-vr", { optionalFeatures: ["hand-tracking"] });
      session.addEventListener("end", () => this.left());
      session.addEventListener("visibilitychange", () => session?.visibilityState === "hidden" && this.rest());
      this.view = new SeatView(eyes);
      this.signs = new Signs(this.room, eyes.who);
      this.signs.hear(this.lines(), performance.now());
      this.said = new Said();
      this.said.hear(this.captions());
      this.view.add(this.hands.left, this.hands.right, this.signs, this.said);
      this.space = await this.room.present(session, this.view, eyes.who, (now, frame) => this.step(now, frame));
    } catch {
      void session?.end().catch(() => {});
      return this.become("refused");
    }
    this.space.addEventListener("reset", () => (this.centred = false)); // somebody has asked for that with the headset's own button
    [this.session, this.centred, this.seenAt, this.pictures] = [session, false, performance.now(), 0];
    this.looking = setInterval(() => performance.now() - this.seenAt > AWAY_MS && this.rest(), LOOK_MS);
    this.become("on");
  }

  /** Lines or captions have come. */
  hear(): void {
    this.signs?.hear(this.lines(), performance.now());
    this.said?.hear(this.captions());
  }

  /** What stands below where the guest looks of what was said to the room. */
  saidToRoom(): string {
    return this.said?.words ?? "";
  }

  /** What stands over somebody's head. */
  signOf(name: string): string {
    return this.signs?.of(name) ?? "";
  }

  close(): void {
    void this.session?.end().catch(() => {});
  }

  private step(now: number, frame: XRFrame): void {
    const head = frame.getViewerPose(this.space!);
    if (head && frame.session.visibilityState !== "hidden") this.follow(now, frame, head);
    if (head) {
      const at = this.view!.inRoom(head.transform);
      this.signs?.step(at, now);
      this.said?.step(at, this.view!.before(head.transform));
    }
    this.draw(now);
    this.pictures++;
  }

  private follow(now: number, frame: XRFrame, head: XRViewerPose): void {
    const view = this.view!;
    this.seenAt = performance.now();
    if (!this.centred) view.centre(head.transform);
    this.centred = true;
    if (this.state === "away") this.become("on");
    const found: Record<string, Measured> = { left: null, right: null };
    this.hands.left.hide();
    this.hands.right.hide();
    const pads: Gamepad[] = [];
    for (const source of frame.session.inputSources) {
      if (source.handedness === "none") continue;
      found[source.handedness] = this.measured(frame, source, this.hands[source.handedness]);
      if (source.gamepad && !source.hand) pads.push(source.gamepad);
    }
    this.steer(pads, head.transform);
    if (now < this.due) return;
    this.due = Math.max(this.due + SEND_MS, now);
    this.sender.say({ ...view.inSeat(head.transform), confidence: head.emulatedPosition ? UNSURE : 1 }, found.left!, found.right!);
  }

  /** What is known of a hand; it is drawn, too. */
  private measured(frame: XRFrame, source: XRInputSource, own: OwnHand): Measured {
    if (source.hand) {
      const joints = [...source.hand.values()].map((joint) => frame.getJointPose?.(joint, this.space!));
      const all = joints.filter((joint) => joint !== undefined && joint !== null);
      if (all.length !== joints.length) return null;
      const figure = this.room?.figures.get(this.eyes()?.who ?? "");
      own.show(all, figure?.joint(`${source.handedness}_hand`).getWorldPosition(new Vector3()) ?? null);
      const places = all.map((joint) => this.view!.inSeat(joint.transform).place);
      return { joints: places, confidence: all.some((joint) => joint.emulatedPosition) ? UNSURE : 1 };
    }
    const grip = source.gripSpace && frame.getPose(source.gripSpace, this.space!);
    if (!grip) return null;
    own.hold(grip.transform);
    const pressed = (button: number) => source.gamepad?.buttons[button]?.value ?? 0;
    const confidence = grip.emulatedPosition ? UNSURE : 1;
    return { ...this.view!.inSeat(grip.transform), trigger: pressed(TRIGGER), squeeze: pressed(SQUEEZE), confidence };
  }

  /** A thumbstick to the side turns the seat by a step; pressed down, it centres the view. */
  private steer(pads: Gamepad[], head: XRRigidTransform): void {
    const aside = pads.map((pad) => pad.axes[STICK_X] ?? 0).reduce((a, b) => (Math.abs(a) > Math.abs(b) ? a : b), 0);
    if (!this.pushed && Math.abs(aside) > PUSHED) {
      this.pushed = true;
      this.view!.turn(-Math.sign(aside), head);
    } else if (Math.abs(aside) < BACK) this.pushed = false;
    const pressed = pads.some((pad) => pad.buttons[STICK]?.pressed);
    if (pressed && !this.pressed) this.view!.centre(head);
    this.pressed = pressed;
  }

  /** Nobody wears it: the figure rests, and the page says so. */
  private rest(): void {
    if (this.state !== "on") return;
    this.become("away");
    this.unworn();
  }

  /** The session has ended, whoever ended it. */
  private left(): void {
    if (!this.session) return;
    clearInterval(this.looking);
    this.signs?.close();
    this.said?.close();
    this.session = this.view = this.space = this.signs = this.said = null;
    this.room?.presentNoMore();
    this.become("ended");
    this.unworn();
    this.over();
  }

  private unworn(): void {
    this.sender.sayNobody(() => this.state !== "on");
  }

  private become(state: State): void {
    this.state = state;
    this.changed();
  }
}

/** The button that leads into the room with a headset, and out again; a line where the page cannot. */
export function HeadsetButton({ headset }: { headset: Headset }) {
  const { state, on } = headset;
  if (state === "none") return null;
  if (state === "insecure") return <span>{text("xr_insecure")}</span>;
  return (
    <button type="button" id="headset" aria-pressed={on} disabled={state === "asking"} onClick={() => (on ? headset.close() : void headset.open())}>
      {text(`xr_${state}`)}
    </button>
  );
}
