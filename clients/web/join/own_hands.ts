// The guest's own hands as their headset measures them, at once; their figure's hands come a moment later, as others see them.
import { CapsuleGeometry, Group, InstancedMesh, Matrix4, Mesh, MeshStandardMaterial, Quaternion, SphereGeometry, Vector3 } from "three";
import { JOINTS, parentOf } from "./poses";

const SEEN = 0.55; // opacity of a hand that is away from the figure's
const HERE_M = 0.025; // a hand that is no farther from the figure's is not drawn...
const AWAY_M = 0.06; // ... and one that is so far is
const THICK_M = 0.008; // of a joint whose size the headset does not tell
const HANDLE_M = 0.018;
const HANDLE_LONG_M = 0.09;
const UP = new Vector3(0, 1, 0);

/** In the headset's space. */
export class OwnHand extends Group {
  private readonly look = new MeshStandardMaterial({ color: 0x9cc3f2, roughness: 0.7, transparent: true });
  private readonly joints = new InstancedMesh(new SphereGeometry(1, 10, 8), this.look, JOINTS);
  private readonly bones = new InstancedMesh(new CapsuleGeometry(1, 1, 2, 8), this.look, JOINTS - 1);
  private readonly handle = new Mesh(new CapsuleGeometry(HANDLE_M, HANDLE_LONG_M, 4, 12).rotateX(Math.PI / 2), this.look);

  constructor() {
    super();
    for (const part of [this.joints, this.bones, this.handle]) {
      part.frustumCulled = part.visible = false;
      this.add(part);
    }
  }

  hide(): void {
    this.joints.visible = this.bones.visible = this.handle.visible = false;
  }

  /** A controller in the hand, at its grip space. */
  hold(grip: XRRigidTransform): void {
    this.hide();
    this.handle.matrix.fromArray(grip.matrix);
    this.look.opacity = SEEN;
    this.handle.matrix.decompose(this.handle.position, this.handle.quaternion, this.handle.scale);
    this.handle.visible = true;
  }

  /** A hand that is seen: poses of its joints. figure: where the figure's wrist is in the room [m]. */
  show(poses: XRJointPose[], figure: Vector3 | null): void {
    this.hide();
    const wrist = poses[0]!.transform.position;
    const off = figure ? this.worldToLocal(figure.clone()).distanceTo(new Vector3(wrist.x, wrist.y, wrist.z)) : AWAY_M;
    this.look.opacity = SEEN * Math.min(1, Math.max(0, (off - HERE_M) / (AWAY_M - HERE_M)));
    if (this.look.opacity === 0) return;
    const at = poses.map(({ transform: { position: p } }) => new Vector3(p.x, p.y, p.z));
    const thick = (n: number) => poses[n]!.radius || THICK_M;
    for (let n = 0; n < JOINTS; n++) {
      this.joints.setMatrixAt(n, new Matrix4().makeScale(thick(n), thick(n), thick(n)).setPosition(at[n]!));
      if (n === 0) continue;
      const from = at[parentOf(n)]!;
      const along = at[n]!.clone().sub(from);
      const turn = new Quaternion().setFromUnitVectors(UP, along.clone().normalize());
      const size = new Vector3(thick(n) * 0.9, along.length(), thick(n) * 0.9);
      this.bones.setMatrixAt(n - 1, new Matrix4().compose(from.clone().addScaledVector(along, 0.5), turn, size));
    }
    this.joints.instanceMatrix.needsUpdate = this.bones.instanceMatrix.needsUpdate = true;
    this.joints.visible = this.bones.visible = true;
  }
}
