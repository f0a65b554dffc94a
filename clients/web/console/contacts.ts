// What touches the person or thing that is chosen: an arrow for each force, and the shapes that press on them, seen through.
import {
  ConeGeometry,
  CylinderGeometry,
  Group,
  Mesh,
  MeshBasicMaterial,
  Vector3,
} from "three";
import { shapesOn } from "./figures/cone_spheres";
import type { Figure } from "./figures/figure";
import type { Force, Primitives } from "./wire";
import type { Chosen } from "./who";

const M_PER_N = 0.006; // of an arrow
const SHORTEST_M = 0.02;
const LONGEST_M = 0.09;
const HEAD_M = 0.011;
const THICK_M = 0.0014;
const NEAR_M = 0.12; // a shape that is farther from where it touches is not seen
const UP = new Vector3(0, 1, 0);
const ARROW = new MeshBasicMaterial({ color: 0xffb020, depthTest: false, transparent: true, toneMapped: false });
const SHAFT = new CylinderGeometry(THICK_M, THICK_M, 1, 8).translate(0, 0.5, 0);
const HEAD = new ConeGeometry(2.6 * THICK_M, HEAD_M, 12).translate(0, 0.5 * HEAD_M, 0);

export class Contacts {
  /** To be put into the scene. */
  readonly root = new Group();
  private forces: Force[] = [];
  private chosen: Chosen = null;
  private readonly shapes = new Map<Primitives, Mesh[]>();

  /** Forces as they are now. Whether something of it is seen. */
  receive(forces: Force[], figures: Map<string, Figure>): boolean {
    this.forces = forces;
    return this.show(figures);
  }

  choose(chosen: Chosen, figures: Map<string, Figure>): boolean {
    this.chosen = chosen;
    return this.show(figures);
  }

  /** How many arrows and shapes are seen. */
  get count(): [arrows: number, shapes: number] {
    return [this.root.children.length, [...this.shapes.values()].flat().filter((shape) => shape.visible).length];
  }

  /** Again, since figures may have put on their files meanwhile. Whether what is seen may have changed. */
  show(figures: Map<string, Figure>): boolean {
    const before = this.root.children.length;
    const id = this.chosen?.person ?? this.chosen?.thing;
    const felt = this.forces.filter(({ who, body }) => who === id || body === id);
    this.root.clear();
    for (const force of felt) this.root.add(arrow(force));
    const worn = new Set([...figures.values()].map((figure) => figure.primitives));
    for (const [primitives, shapes] of this.shapes) {
      if (!worn.has(primitives)) this.shapes.delete(primitives);
      for (const shape of shapes) shape.visible = false;
    }
    for (const { who, body, at } of felt) {
      const other = figures.get(who === id ? body : who);
      if (other) this.showShapes(other, new Vector3(...at));
    }
    return before + felt.length > 0;
  }

  /** Those of somebody's primitives that are near a place. */
  private showShapes(figure: Figure, at: Vector3): void {
    if (!figure.primitives) return;
    const shapes = this.shapes.get(figure.primitives) ?? shapesOn((joint) => figure.bone(joint), figure.primitives);
    this.shapes.set(figure.primitives, shapes);
    figure.root.updateMatrixWorld(true);
    const place = new Vector3();
    for (const shape of shapes) if (shape.getWorldPosition(place).distanceTo(at) < NEAR_M) shape.visible = true;
  }
}

/** From where it acts, along the force on the hand. */
function arrow({ at, force }: Force): Group {
  const along = new Vector3(...force);
  const length = Math.min(LONGEST_M, Math.max(SHORTEST_M, M_PER_N * along.length()));
  const [shaft, head] = [new Mesh(SHAFT, ARROW), new Mesh(HEAD, ARROW)];
  shaft.scale.y = length - HEAD_M;
  head.position.y = length - HEAD_M;
  shaft.renderOrder = head.renderOrder = 1; // over skin: the place where two touch is hidden by both
  const group = new Group();
  group.add(shaft, head);
  group.position.set(...at);
  group.quaternion.setFromUnitVectors(UP, along.normalize());
  return group;
}
