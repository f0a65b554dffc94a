// What says where the guest's head and hands are, for a headset or for what stands in for one.
import type { Link } from "../connection/link";
import { type Measured, type Pose, record } from "./poses";

export const SEND_MS = 1000 / 30;
const AGAIN_MS = 100;

export class PoseSender {
  sent = 0; // bytes

  constructor(private readonly link: () => Link) {}

  /** head: null where nobody is measured. */
  say(head: Pose | null, left: Measured, right: Measured): void {
    const data = record(head, left, right);
    this.sent += data.byteLength;
    this.link().tell({ kind: "seen", data, at: performance.timeOrigin + performance.now() }, [data]);
  }

  /** Say that nobody is measured, where that still holds; twice, since the gateway leaves out what comes right after something else. */
  sayNobody(holds: () => boolean): void {
    for (const ms of [0, AGAIN_MS]) setTimeout(() => holds() && this.say(null, null, null), ms);
  }
}
