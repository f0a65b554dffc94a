// Where people read in the room: the fronts of boards and panels, as rectangles.
import { type Object3D, Vector3 } from "three";
import type { Face } from "./wire";

/** centre, normal: in the room; up: unit; wide, high: [m]; corners: from the first one round. */
export interface FrontInRoom {
  centre: Vector3;
  normal: Vector3;
  up: Vector3;
  wide: number;
  high: number;
  corners: Vector3[];
}

/** The front of a thing, as it stands. */
export function frontInRoom(front: Face, node: Object3D): FrontInRoom {
  const [corner, across, up] = front.map((edge) => new Vector3(...edge)) as [Vector3, Vector3, Vector3];
  const [wide, high] = [across.length(), up.length()];
  const normal = across.clone().cross(up).normalize().applyQuaternion(node.quaternion);
  node.updateMatrixWorld(true);
  const corners = [corner, corner.clone().add(across), corner.clone().add(across).add(up), corner.clone().add(up)];
  for (const place of corners) place.applyMatrix4(node.matrixWorld);
  const centre = corners[0]!.clone().add(corners[2]!).multiplyScalar(0.5);
  return { centre, normal, up: up.normalize().applyQuaternion(node.quaternion), wide, high, corners };
}
