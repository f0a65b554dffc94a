// When the room is drawn: with each picture of the screen while something moves, and not at all while nothing does.

export class Pictures {
  private waits = false; // a picture has been asked for
  private resting = false;
  private visible = true; // some of the canvas is within the window
  private askedAt = 0;

  /** ready: whether a picture can be drawn now; draw: draws at a time of `performance` [ms], and says whether something goes on moving. restMs: for how long nothing is drawn
   * after a picture that was there so long after it had been asked for [ms]. */
  constructor(
    canvas: HTMLCanvasElement,
    private readonly ready: () => boolean,
    private readonly draw: (now: number) => boolean,
    private readonly restMs: (took: number) => number = () => 0,
  ) {
    new IntersectionObserver((entries) => {
      this.visible = entries[entries.length - 1]!.isIntersecting;
      if (this.visible) this.ask();
    }).observe(canvas);
  }

  /** Draw once more: whatever changes what is seen says so here. */
  ask(): void {
    if (this.waits) return;
    this.waits = true;
    if (!this.resting) this.request();
  }

  private request(): void {
    this.askedAt = performance.now();
    requestAnimationFrame((now) => this.show(now));
  }

  private show(now: number): void {
    if (!this.ready()) return void requestAnimationFrame((later) => this.show(later));
    this.waits = false;
    if (!this.visible) return;
    if (this.draw(now)) this.waits = true;
    const rest = this.restMs(performance.now() - this.askedAt);
    this.resting = rest > 0;
    if (this.resting) setTimeout(() => this.wake(), rest);
    else if (this.waits) this.request();
  }

  private wake(): void {
    this.resting = false;
    if (this.waits) this.request();
  }
}

/** Whether the processor draws: edges are then left rough, since each pixel costs. */
export function drawnBySoftware(): boolean {
  const context = document.createElement("canvas").getContext("webgl2");
  const told = context?.getExtension("WEBGL_debug_renderer_info"); // without it, Chromium says "WebKit WebGL" of all
  const name = String(context?.getParameter(told?.UNMASKED_RENDERER_WEBGL ?? context.RENDERER) ?? "");
  context?.getExtension("WEBGL_lose_context")?.loseContext();
  return /swiftshader|llvmpipe|software/i.test(name);
}
