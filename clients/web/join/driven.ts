// What programs that drive a guest's page find in its window.
import type { Microphone } from "../sound/microphone";
import type { Voices } from "../sound/voices";
import type { Camera } from "./camera";
import type { Headset } from "./headset";
import type { Sharing } from "./sharing";
import type { Wand } from "./wand";

declare global {
  interface Window {
    /** For programs that drive the page. me: the guest's participant, once their figure is in the room; joints: places of somebody's
     * joints in the room [m]; seen: where a point of the room is on the page [px]; ready: how many have
     * their own figures; screens: pictures of somebody's screen that were decoded; sent: bytes of what the guest does and says. */
    guest?: {
      me(): string | null;
      joints(name: string): [number, number, number][];
      thing(id: string): [number, number, number] | null;
      seen(at: [number, number, number]): [number, number];
      held(): [string, string, string][];
      own(): boolean;
      ready(): number;
      sent(): number;
      sharp(): void;
      voices: Voices;
      microphone: Microphone;
      camera: Camera;
      headset: Headset;
      wand: Wand;
      sharing: Sharing;
      screens(participant: string): number;
    };
  }
}
