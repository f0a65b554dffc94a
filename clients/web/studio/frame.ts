// The frame round all studios: where one is, the others, and the room of the conference that runs on this machine.
import { phrases, switchLanguage } from "../console/language";

const NAMES = phrases(
  { avatar: "Avatar", wrinkles: "Wrinkles", calibration: "Calibration", room: "Room", studios: "Studios", language: "日本語" },
  { avatar: "アバター", wrinkles: "しわ", calibration: "校正", room: "部屋", studios: "スタジオ", language: "English" },
);
type Studio = "avatar" | "wrinkles" | "calibration";

/** Lay out the links. here: the studio of this page. */
export async function frame(here: Studio): Promise<void> {
  document.documentElement.dataset.begun = "true"; // missing.js says what is wrong where this does not come
  const other = document.getElementById("language")!;
  other.textContent = NAMES("language");
  other.onclick = () => (switchLanguage(), location.reload());
  const nav = document.getElementById("studios")!;
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
