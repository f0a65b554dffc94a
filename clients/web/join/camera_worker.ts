// The worker in which @mediapipe/holistic finds landmarks, so that the page goes on drawing. That package wants to be on a page: it
// adds its scripts to the document and draws on a canvas. So it is given a document with no more than that.
import type { Found, Landmark } from "./landmarks";

export interface Picture {
  bitmap: ImageBitmap;
  at: number; // when it was taken: time of day [ms]
}
export interface Answer {
  found?: Found;
  light?: number; // mean brightness of the picture, 0 to 255
  at?: number;
  tookMs?: number;
  ready?: boolean;
  failed?: string;
}
interface Results {
  poseLandmarks?: Landmark[];
  leftHandLandmarks?: Landmark[];
  rightHandLandmarks?: Landmark[];
  faceLandmarks?: Landmark[];
}
interface Solution {
  setOptions(options: object): void;
  onResults(listener: (results: Results) => void): void;
  initialize(): Promise<void>;
  send(inputs: { image: ImageBitmap }): Promise<void>;
}
type Scope = typeof globalThis & { Holistic: new (config: object) => Solution; importScripts(url: string): void };

class Script {
  src = "";
  private readonly listeners: Record<string, () => void> = {};
  setAttribute(name: "src", value: string): void {
    this[name] = value;
  }
  addEventListener(kind: string, listener: () => void): void {
    this.listeners[kind] = listener;
  }
  load(): void {
    scope.importScripts(this.src);
    this.listeners.load?.();
  }
}
const scope = self as unknown as Scope;
const nothing = () => {};
const body = { appendChild: (script: Script) => script.load() };
const createElement = (tag: string) => (tag === "canvas" ? new OffscreenCanvas(1, 1) : new Script());
const page = { createElement, createEvent: () => ({ initCustomEvent: nothing }), addEventListener: nothing, removeEventListener: nothing, body };
Object.assign(scope, { window: self, document: page, alert: (text: string) => tell({ failed: text }) });

const [WIDE, HIGH] = [16, 12];
const small = new OffscreenCanvas(WIDE, HIGH).getContext("2d", { willReadFrequently: true })!;
const tell = (answer: Answer) => postMessage(answer);

/** Of a world landmark the package's name is one that its minifier chose: of the points found, those that are no others'. */
function worldOf(results: Results): Landmark[] | undefined {
  const pose = results.poseLandmarks;
  const others = Object.values(results).filter((v) => Array.isArray(v) && v.length === pose?.length && v !== pose && "visibility" in v[0]);
  return others[0] as Landmark[] | undefined;
}

async function begin(): Promise<Solution> {
  scope.importScripts("holistic.js");
  const solution = new scope.Holistic({ locateFile: (file: string) => file });
  solution.setOptions({ modelComplexity: 1, smoothLandmarks: false, refineFaceLandmarks: true });
  await solution.initialize();
  return solution;
}

const solution = begin();
solution.then(() => tell({ ready: true }), (error: unknown) => tell({ failed: String(error) }));

onmessage = async ({ data }: MessageEvent<Picture>) => {
  const began = performance.now();
  const { bitmap, at } = data;
  try {
    small.drawImage(bitmap, 0, 0, WIDE, HIGH);
    const pixels = small.getImageData(0, 0, WIDE, HIGH).data;
    const light = pixels.reduce((sum, value, n) => sum + (n % 4 < 3 ? value : 0), 0) / (3 * WIDE * HIGH);
    const results = await new Promise<Results>((resolve, reject) => {
      void solution.then((holistic) => {
        holistic.onResults(resolve);
        holistic.send({ image: bitmap }).catch(reject);
      }, reject);
    });
    const found: Found = {
      body: results.poseLandmarks,
      world: worldOf(results),
      left: results.leftHandLandmarks,
      right: results.rightHandLandmarks,
      face: results.faceLandmarks,
    };
    tell({ found, light, at, tookMs: performance.now() - began });
  } catch (error) {
    tell({ failed: String(error) });
  }
  bitmap.close();
};
