// The frame round all studios: where one is, the others, and the room of the conference that runs on this machine.
import { phrases } from "../console/language";

const NAMES = phrases(
  { avatar: "Avatar", wrinkles: "Wrinkles", calibration: "Calibration", room: "Room", studios: "Studios" },
  { avatar: "アバター", wrinkles: "しわ", calibration: "校正", room: "部屋", studios: "スタジオ" },
);
type Studio = "avatar" | "wrinkles" | "calibration";

/** Lay out the links. here: the studio of this page. */
export async function frame(here: Studio): Promise<void> {
  const nav = document.getElementById("studios");
  if (!nav) return;
  nav.setAttribute("aria-label", NAMES("studios"));
  const answer = await fetch("../studios.json");
  const { studios, console } = (await answer.json()) as { studios: Studio[]; console: string };
  nav.replaceChildren(...studios.map((studio) => link(`../${studio}/`, NAMES(studio), studio === here)));
  if (console) nav.append(link(console, NAMES("room"), false));
}

function link(to: string, text: string, here: boolean): HTMLAnchorElement {
  const a = document.createElement("a");
  [a.href, a.textContent] = [to, text];
  if (here) a.setAttribute("aria-current", "page");
  return a;
}
