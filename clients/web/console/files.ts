// Files of the room: all are fetched at once; what is slow to show is shown in turn, so that the room is seen meanwhile.
import { FileLoader, type Group } from "three";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";

export class Files {
  private readonly fetching = new FileLoader().setResponseType("arraybuffer");
  private readonly reading = new GLTFLoader();
  private turn: Promise<unknown> = Promise.resolve();

  /** picture: resolves once a picture that is drawn from now on is there. */
  constructor(private readonly picture: () => Promise<void>) {}

  /** Ask with the token of a guest's link. */
  show(token: string): void {
    this.fetching.setRequestHeader({ Authorization: `Bearer ${token}` });
  }

  /** What a file holds. Rejects where it does not come, or is none. */
  async take(digest: string): Promise<Group> {
    return this.read(this.fetch(digest));
  }

  /** As `take`, but one file after the other, each once the picture with the one before is there: where the processor draws, such a
   * picture takes seconds. wanted: whether it still is; put: shows it. */
  async takeInTurn(digest: string, wanted: () => boolean, put: (scene: Group) => void): Promise<void> {
    const data = this.fetch(digest);
    const turn = this.turn.then(async () => {
      if (!wanted()) return;
      put(await this.read(data));
      await this.picture();
    });
    this.turn = Promise.allSettled([data, turn]);
    return turn;
  }

  private async fetch(digest: string): Promise<ArrayBuffer> {
    return (await this.fetching.loadAsync(`asset/${digest}.glb`)) as ArrayBuffer;
  }

  private async read(data: Promise<ArrayBuffer>): Promise<Group> {
    return (await this.reading.parseAsync(await data, "")).scene;
  }
}
