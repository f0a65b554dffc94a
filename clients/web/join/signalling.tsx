// What a guest says without words: a raised hand, and reactions; by button and by key.
import { REACTIONS, type Reaction } from "../console/wire";
import { Menu } from "./menu";
import { text } from "./words";

const AGAIN_MS = 1050; // from one reaction to the next: the world takes one a second
const HAND_KEY = "R"; // reactions have the keys 1 to 5
type Said = { hand_down: boolean } | { react: Reaction };

export class Signalling {
  private reactedAt = -Infinity;

  /** up: whether the guest's hand is raised. */
  constructor(
    readonly up: () => boolean,
    private readonly say: (said: Said) => void,
  ) {}

  raise(): void {
    this.say({ hand_down: this.up() });
  }

  react(reaction: Reaction): void {
    const now = performance.now();
    if (now - this.reactedAt < AGAIN_MS) return;
    this.reactedAt = now;
    this.say({ react: reaction });
  }

  /** Whether a key said something. */
  press(key: string): boolean {
    const reaction = REACTIONS[Number(key) - 1];
    if (key.toUpperCase() === HAND_KEY) this.raise();
    else if (reaction) this.react(reaction);
    else return false;
    return true;
  }
}

export function SignalButtons({ signalling }: { signalling: Signalling }) {
  const up = signalling.up();
  return (
    <>
      <button type="button" id="raise" aria-pressed={up} onClick={() => signalling.raise()}>
        {text(up ? "hand_down" : "hand_up")} <kbd>{HAND_KEY}</kbd>
      </button>
      <Menu id="reactions" label={text("reactions")}>
        {REACTIONS.map((name, n) => (
          <button type="button" key={name} id={`react-${name}`} onClick={() => signalling.react(name)}>
            {text(name === "clap" ? "applause" : name)} <kbd>{n + 1}</kbd>
          </button>
        ))}
      </Menu>
    </>
  );
}
