// Files of the room: all are fetched at once; what is slow to show is shown in turn, so that the room is seen meanwhile.
import { FileLoader, type Group } from "three";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import { shine } from "./figures/strands";

const FIRST_WAIT_MS = 500;
const MOST_WAIT_MS = 4000; // who still has none after it is seen as a stand-in

export class Files {
  private readonly fetching = new FileLoader().setResponseType("arraybuffer");
  private turn: Promise<unknown> = Promise.resolve();

  /** Ask with the token of a guest's link. */
  show(token: string): void {
    this.fetching.setRequestHeader({ Authorization: `Bearer ${token}` });
  }

  /** What a file holds. Rejects where it does not come, or is none. */
  async take(digest: string): Promise<Group> {
    return readGlb(await this.fetch(digest));
  }

  /** As `take`, but what they hold is put in its place one file after the other. ready: asked when it is a file's turn; whether it is
   * still wanted. */
  async takeInTurn(digest: string, ready: () => Promise<boolean>, put: (scene: Group) => void): Promise<void> {
    const data = this.fetch(digest);
    const turn = this.turn.then(async () => (await ready()) && put(await readGlb(await data)));
    this.turn = Promise.allSettled([data, turn]);
    await turn;
  }

  /** Asks again where a link breaks meanwhile. */
  private async fetch(digest: string): Promise<ArrayBuffer> {
    for (let wait = FIRST_WAIT_MS; ; wait *= 2)
      try {
        return (await this.fetching.loadAsync(`asset/${digest}.glb`)) as ArrayBuffer;
      } catch (e) {
        if (wait > MOST_WAIT_MS) throw e;
        await new Promise((done) => setTimeout(done, wait));
      }
  }
}

/** What a file holds. Rejects where it is none. */
export async function readGlb(data: ArrayBuffer): Promise<Group> {
  const { scene, parser } = await new GLTFLoader().parseAsync(data, "");
  const avatar = parser.json.extensions?.VISTEL_avatar; // of a figure
  scene.userData.primitives = avatar?.primitives;
  shine(scene, avatar?.patches ?? []);
  return scene;
}
