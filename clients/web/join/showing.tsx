// What a guest shows in the room: a picture, or the pages of a PDF, on a panel that everybody sees.
import type { pagesOf } from "./pdf";
import { text } from "./words";

const SIDE = 1600; // pixels of a page, as vistel.space.pages.sheet has it
const MOST_BYTES = 3 << 20; // the same
const READER: string = "./pdf.js"; // loaded when somebody shows a PDF

type Said = { show: string } | { turn: 1 | -1 } | { away: true };

export class Showing {
  /** Panels that the guest has put up. */
  panels = 0;
  /** What goes on, or why something could not be shown; empty: nothing. */
  told = "";
  busy = false;

  constructor(
    private readonly token: string,
    private readonly say: (said: Said) => void,
    private readonly changed: () => void,
  ) {}

  /** The world has answered. */
  hear(words: { done: boolean; reason: string; panels: number }): void {
    this.panels = words.panels;
    this.tell(words.done ? "" : words.reason);
  }

  /** Send a file page by page, and put it up. */
  async show(file: File): Promise<void> {
    this.busy = true;
    try {
      let sent = 0;
      for await (const { page, of } of pages(file)) {
        this.tell(text("show_sends", `${sent + 1}`, `${of}`));
        const answer = await fetch("guest/page", {
          method: "POST",
          body: await packed(page, file.type === "image/jpeg"),
          headers: { Authorization: `Bearer ${this.token}` },
        });
        if (!answer.ok) throw new Error(await answer.text());
        sent += 1;
      }
      this.say({ show: file.name.replace(/\.\w+$/, "") });
      this.tell("");
    } catch (fault) {
      this.tell(`${text("show_cannot")} ${fault instanceof Error ? fault.message : ""}`);
    } finally {
      this.busy = false;
      this.changed();
    }
  }

  turn(by: 1 | -1): void {
    this.say({ turn: by });
  }

  away(): void {
    this.say({ away: true });
  }

  private tell(what: string): void {
    this.told = what;
    this.changed();
  }
}

async function* pages(file: File): AsyncGenerator<{ page: HTMLCanvasElement; of: number }> {
  if (file.type === "application/pdf" || file.name.toLowerCase().endsWith(".pdf")) {
    const reader = (await import(READER)) as { pagesOf: typeof pagesOf };
    yield* reader.pagesOf(file, SIDE);
    return;
  }
  const picture = await createImageBitmap(file);
  const scale = Math.min(1, SIDE / Math.max(picture.width, picture.height));
  const page = document.createElement("canvas");
  [page.width, page.height] = [Math.max(1, Math.round(picture.width * scale)), Math.max(1, Math.round(picture.height * scale))];
  const drawn = page.getContext("2d")!;
  drawn.imageSmoothingQuality = "high";
  drawn.fillStyle = "white";
  drawn.fillRect(0, 0, page.width, page.height);
  drawn.drawImage(picture, 0, 0, page.width, page.height);
  picture.close();
  yield { page, of: 1 };
}

/** A page as it is sent: to the last bit, but for photographs and what would be too much. */
async function packed(page: HTMLCanvasElement, photograph: boolean): Promise<Blob> {
  const as = (kind: string) =>
    new Promise<Blob>((done, failed) => page.toBlob((made) => (made ? done(made) : failed(new Error("no picture"))), kind, 0.92));
  const whole = photograph ? null : await as("image/png");
  return whole && whole.size <= MOST_BYTES ? whole : as("image/jpeg");
}

/** Choose a file. */
export function ShowChoice({ showing }: { showing: Showing }) {
  const chosen = (event: Event) => {
    const input = event.currentTarget as HTMLInputElement;
    const file = input.files?.[0];
    if (file) void showing.show(file);
    input.value = "";
  };
  return (
    <label class="button" id="show" aria-disabled={showing.busy}>
      {text("show")}
      <input type="file" accept="image/png,image/jpeg,application/pdf" disabled={showing.busy} onChange={chosen} />
    </label>
  );
}

/** What can be done with what is shown. */
export function ShowButtons({ showing }: { showing: Showing }) {
  return (
    <>
      {showing.panels > 0 && (
        <>
          <button type="button" id="page-back" aria-label={text("page_back")} onClick={() => showing.turn(-1)}>◀</button>
          <button type="button" id="page-next" aria-label={text("page_next")} onClick={() => showing.turn(1)}>▶</button>
          <button type="button" id="show-away" onClick={() => showing.away()}>{text("show_away")}</button>
        </>
      )}
      {showing.told && <span role="status" id="show-told">{showing.told}</span>}
    </>
  );
}
