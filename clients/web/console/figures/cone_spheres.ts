// The primitives of a figure as shapes that are seen through.
import { type Bone, LatheGeometry, Mesh, MeshStandardMaterial, Vector2, Vector3 } from "three";
import type { Primitives } from "../wire";

const STEPS = 6; // of a cone-sphere's round end
const AROUND = 14;
const UP = new Vector3(0, 1, 0);
const SHAPE = new MeshStandardMaterial({ color: 0x58b4ff, roughness: 0.5, transparent: true, opacity: 0.35, depthWrite: false });

/** A mesh for each primitive, on the bone that carries it, not seen at first. */
export function shapesOn(bones: (joint: number) => Bone, { joint, a, b, radiusA, radiusB }: Primitives): Mesh[] {
  return joint.map((bone, n) => {
    const [from, to] = [new Vector3(...a[n]!), new Vector3(...b[n]!)];
    const shape = new Mesh(coneSphere(from.distanceTo(to), radiusA[n]!, radiusB[n]!), SHAPE);
    shape.position.copy(from).add(to).multiplyScalar(0.5);
    shape.quaternion.setFromUnitVectors(UP, to.sub(from).normalize());
    shape.visible = false;
    bones(bone).add(shape);
    return shape;
  });
}

/** Two spheres and the cone round both, along y, its middle at the origin. */
function coneSphere(length: number, radiusA: number, radiusB: number): LatheGeometry {
  const tilt = length > 0 ? Math.asin(Math.min(1, Math.max(-1, (radiusA - radiusB) / length))) : 0; // where the cone meets the spheres
  const points: Vector2[] = [];
  const arc = (radius: number, y: number, from: number, to: number) => {
    for (let n = 0; n <= STEPS; n++) {
      const angle = from + ((to - from) * n) / STEPS;
      points.push(new Vector2(Math.max(1e-6, radius * Math.cos(angle)), y + radius * Math.sin(angle)));
    }
  };
  arc(radiusA, -length / 2, -Math.PI / 2, tilt);
  arc(radiusB, length / 2, tilt, Math.PI / 2);
  return new LatheGeometry(points, AROUND);
}
