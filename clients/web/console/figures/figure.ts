// A person: joints that follow the frames, and on them a stand-in until the figure's own file is there.
import {
  Bone,
  CapsuleGeometry,
  Group,
  Mesh,
  MeshStandardMaterial,
  Quaternion,
  SkinnedMesh,
  SphereGeometry,
  Vector3,
} from "three";
import { dispose } from "../dispose";
import { Pressed, type PressedRow } from "./skin";
import type { Joints, PersonFrame, PersonRow, Primitives } from "../wire";

const STAND_IN = new MeshStandardMaterial({ color: 0x8a93a0, roughness: 0.8 });
const GHOST = new MeshStandardMaterial({
  color: 0x6fb7ff,
  roughness: 0.6,
  transparent: true,
  opacity: 0.45,
  ...{ polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 4 }, // where both are in one place, the figure is seen
});
const THICKNESS_M = 0.045; // of a stand-in's limbs
const FINGER_M = 0.009;
const HEAD_M = 0.1;
const HEADLESS = 1e-3; // scale of a head that is not to be seen
const HEAD_ABOVE_M = 0.27; // of a name over the head's joint

interface Pose {
  rotation: Quaternion[];
  shift: Vector3[];
  hips: Vector3;
}

interface Face {
  influences: number[];
  at: number[]; // which of them each shape of a frame is; -1: none
}

export class Figure {
  readonly root = new Group();
  talks = false;
  own = false; // it is the figure of its own file
  primitives: Primitives | null = null; // of that
  private bones: Bone[];
  private readonly faces: Face[] = [];
  private readonly from: Pose;
  private readonly to: Pose;
  private arrived = 0;
  private newest: PersonFrame | null = null;
  private shown: Group;
  private skin: Pressed | null = null; // of its own file
  private pressedBy: PressedRow | null = null;

  constructor(
    public about: PersonRow,
    private readonly joints: Joints,
    private readonly ghost = false, // transparent, and without a shadow
  ) {
    this.from = this.noPose();
    this.to = this.noPose();
    this.bones = this.chain();
    this.shown = new Group();
    this.shown.add(this.bones[0]!);
    this.root.add(this.shown);
    this.root.visible = false;
    this.standIn();
  }

  /** Take what the figure's own file holds in place of the stand-in; nothing, where that has other joints. */
  wear(scene: Group): void {
    const meshes: SkinnedMesh[] = [];
    scene.traverse((node) => node instanceof SkinnedMesh && meshes.push(node));
    const bones = meshes[0]?.skeleton.bones;
    if (!bones || bones.length !== this.joints.names.length) return;
    for (const mesh of meshes) {
      mesh.frustumCulled = false;
      mesh.castShadow = mesh.receiveShadow = !this.ghost;
      if (this.ghost) mesh.material = GHOST;
      const face = this.movedBy(mesh);
      if (face) this.faces.push(face);
    }
    this.root.remove(this.shown);
    dispose(this.shown);
    this.shown = scene;
    this.bones = bones;
    this.own = true;
    this.primitives = scene.userData.primitives ?? null;
    this.skin = new Pressed([meshes[0]!]);
    this.press(this.pressedBy);
    this.root.add(scene);
    if (!this.newest) return;
    this.express(this.newest.face);
    this.beThere();
  }

  /** Have skin give way; null: nothing presses on it. */
  press(row: PressedRow | null): void {
    this.pressedBy = row;
    this.skin?.press(row);
  }

  /** Corners of its skin that are pressed, and where each is in the room [m]. */
  pressed(): [corner: number, x: number, y: number, z: number][] {
    this.root.updateMatrixWorld(true);
    return this.skin?.places() ?? [];
  }

  /** A frame that has just come; from where the figure is now it moves there. False where it is as the one before. */
  receive(frame: PersonFrame, now: number): boolean {
    if (this.newest && alike(this.newest, frame)) return false;
    for (let j = 0; j < this.bones.length; j++) {
      this.from.rotation[j]!.copy(this.bones[j]!.quaternion);
      this.to.rotation[j]!.fromArray(frame.rotations, 4 * j);
    }
    this.joints.shifted.forEach((j, k) => {
      this.from.shift[k]!.copy(this.bones[j]!.position);
      this.to.shift[k]!.fromArray(frame.shifts, 3 * k);
    });
    this.from.hips.copy(this.bones[0]!.position);
    this.to.hips.set(...frame.hips);
    this.arrived = now;
    this.talks = frame.talks;
    this.express(frame.face);
    if (!this.newest) this.beThere();
    this.newest = frame;
    return (this.root.visible = true);
  }

  private express(face: Uint8Array): void {
    for (const { influences, at } of this.faces)
      at.forEach((target, n) => target >= 0 && (influences[target] = face[n]! / 255));
  }

  /** Be where the newest frame says at once: whoever asks for a joint before the next picture must not find the file's own pose. */
  private beThere(): void {
    this.arrived = -Infinity;
    this.pose(1);
  }

  /** Where it is between two frames; overMs: from one to the next, 0 to be there at once. */
  step(now: number, overMs: number): void {
    if (!this.newest) return;
    this.pose(overMs > 0 ? Math.min(1, Math.max(0, (now - this.arrived) / overMs)) : 1);
  }

  /** share: of the way from the frame before to the newest. */
  private pose(share: number): void {
    this.bones.forEach((bone, j) => bone.quaternion.slerpQuaternions(this.from.rotation[j]!, this.to.rotation[j]!, share));
    this.joints.shifted.forEach((j, k) => this.bones[j]!.position.lerpVectors(this.from.shift[k]!, this.to.shift[k]!, share));
    this.bones[0]!.position.lerpVectors(this.from.hips, this.to.hips, share);
  }

  /** Places of all joints in the room [m], as they stand now. */
  places(): [number, number, number][] {
    this.root.updateMatrixWorld(true);
    return this.bones.map((bone) => bone.getWorldPosition(new Vector3()).toArray());
  }

  joint(name: string): Bone {
    return this.bone(this.joints.names.indexOf(name));
  }

  bone(joint: number): Bone {
    return this.bones[joint]!;
  }

  /** Without its head, for who looks out of its eyes; or with it. */
  behead(without: boolean): void {
    this.joint("head").scale.setScalar(without ? HEADLESS : 1);
  }

  /** Where the name stands. */
  overHead(): Vector3 {
    return this.joint("head").getWorldPosition(new Vector3()).add(new Vector3(0, HEAD_ABOVE_M, 0));
  }

  remove(): void {
    this.root.removeFromParent();
    dispose(this.shown);
  }

  /** How the shapes of frames move a mesh; it keeps only morph targets that do, since each costs time at every vertex. */
  private movedBy(mesh: SkinnedMesh): Face | null {
    const names = mesh.morphTargetDictionary;
    const targets = mesh.geometry.morphAttributes.position;
    if (!names || !targets) return null;
    const kept = this.joints.face.filter((name) => name in names && targets[names[name]!]!.array.some((x) => x !== 0));
    mesh.geometry.morphAttributes = kept.length ? { position: kept.map((name) => targets[names[name]!]!) } : {};
    const influences = (mesh.morphTargetInfluences = kept.map(() => 0));
    return kept.length ? { influences, at: this.joints.face.map((name) => kept.indexOf(name)) } : null;
  }

  private noPose(): Pose {
    return {
      rotation: this.joints.names.map(() => new Quaternion()),
      shift: this.joints.shifted.map(() => new Vector3()),
      hips: new Vector3(),
    };
  }

  private chain(): Bone[] {
    const bones = this.joints.names.map((name, j) => {
      const bone = new Bone();
      bone.name = name;
      bone.position.set(...this.about.rest[j]!);
      return bone;
    });
    this.joints.parents.forEach((p, j) => p >= 0 && bones[p]!.add(bones[j]!));
    return bones;
  }

  private standIn(): void {
    const fingers = new Set(this.joints.fingers);
    this.joints.parents.forEach((p, j) => {
      const along = new Vector3(...this.about.rest[j]!);
      if (p < 0 || along.length() < 0.01 || this.joints.names[j]!.endsWith("_eye")) return;
      const radius = fingers.has(j) ? FINGER_M : THICKNESS_M;
      const limb = new Mesh(new CapsuleGeometry(radius, Math.max(0.001, along.length() - radius), 3, 8), this.ghost ? GHOST : STAND_IN);
      limb.position.copy(along).multiplyScalar(0.5);
      limb.quaternion.setFromUnitVectors(new Vector3(0, 1, 0), along.normalize());
      limb.castShadow = !this.ghost;
      this.bones[p]!.add(limb);
    });
    const head = new Mesh(new SphereGeometry(HEAD_M, 16, 12), this.ghost ? GHOST : STAND_IN);
    head.position.y = HEAD_M;
    this.joint("head").add(head);
  }
}

/** Whether two frames show somebody in the same pose, with the same face. */
function alike(a: PersonFrame, b: PersonFrame): boolean {
  return a.talks === b.talks && same(a.hips, b.hips) && same(a.shifts, b.shifts) && same(a.rotations, b.rotations) && same(a.face, b.face);
}

function same(a: ArrayLike<number>, b: ArrayLike<number>): boolean {
  for (let n = 0; n < a.length; n++) if (a[n] !== b[n]) return false;
  return a.length === b.length;
}
