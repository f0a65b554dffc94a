// The pages of a PDF as pictures; loaded when somebody shows one.
import { getDocument, GlobalWorkerOptions } from "pdfjs-dist";

const MOST_PAGES = 100;

GlobalWorkerOptions.workerSrc = "./pdf_worker.js";

/** Each page, at most `side` pixels wide and high. Raises where the file is no PDF that can be read. */
export async function* pagesOf(file: Blob, side: number): AsyncGenerator<{ page: HTMLCanvasElement; of: number }> {
  const data = new Uint8Array(await file.arrayBuffer());
  const task = getDocument({ data, disableFontFace: true, useSystemFonts: true, useWasm: false });
  try {
    const pdf = await task.promise;
    const of = Math.min(pdf.numPages, MOST_PAGES);
    for (let number = 1; number <= of; number += 1) {
      const page = await pdf.getPage(number);
      const { width, height } = page.getViewport({ scale: 1 });
      const viewport = page.getViewport({ scale: side / Math.max(width, height) });
      const canvas = document.createElement("canvas");
      [canvas.width, canvas.height] = [Math.round(viewport.width), Math.round(viewport.height)];
      await page.render({ canvas, viewport, background: "white" }).promise;
      page.cleanup();
      yield { page: canvas, of };
    }
  } finally {
    await task.destroy();
  }
}
