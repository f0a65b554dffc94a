// The figure of an avatar's file on a floor, in the light of the room: posed, with what is inside it shown on demand.
import {
  BufferGeometry,
  CircleGeometry,
  Color,
  LineBasicMaterial,
  LineSegments,
  type Material,
  Mesh,
  MeshStandardMaterial,
  PerspectiveCamera,
  Scene,
  SkinnedMesh,
  Vector3,
  WebGLRenderer,
} from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import { shapesOn } from "../../console/figures/cone_spheres";
import { readGlb } from "../../console/files";
import { lit } from "../../console/light";
import { orbitedByKey } from "../../console/orbit_keys";
import { drawnBySoftware, Pictures } from "../../console/pictures";
import type { Primitives } from "../../console/wire";

const FIELD = 30;
const BACKGROUND = new Color(0x23272b);
const FLOOR = new MeshStandardMaterial({ color: 0x4a4d50, roughness: 0.95 });
const GREY = new MeshStandardMaterial({ color: 0x9a9a98, roughness: 0.7 });
const BONE = new LineBasicMaterial({ color: 0xffb020, depthTest: false, transparent: true, toneMapped: false });

export type View = "whole" | "face" | "hands" | "behind";
export interface Pose {
  positions: [number, number, number][];
  rotations: [number, number, number, number][];
}

export class Stage {
  private readonly scene = new Scene();
  private readonly camera = new PerspectiveCamera(FIELD, 1, 0.05, 40);
  private readonly renderer: WebGLRenderer;
  private readonly controls: OrbitControls;
  private readonly pictures: Pictures;
  private readonly lines = new LineSegments(new BufferGeometry(), BONE);
  private meshes: SkinnedMesh[] = [];
  private ownMaterials: (Material | Material[])[] = [];
  private shapes: Mesh[] = [];
  drawn = 0; // pictures so far

  constructor(private readonly canvas: HTMLCanvasElement, private readonly joints: string[]) {
    this.renderer = new WebGLRenderer({ canvas, antialias: !drawnBySoftware() });
    this.scene.background = BACKGROUND;
    lit(this.scene, this.renderer);
    const floor = new Mesh(new CircleGeometry(6, 64).rotateX(-Math.PI / 2), FLOOR);
    floor.receiveShadow = true;
    this.lines.visible = this.lines.frustumCulled = false;
    this.lines.renderOrder = 2;
    this.scene.add(floor, this.lines);
    this.controls = new OrbitControls(this.camera, canvas);
    Object.assign(this.controls, { minDistance: 0.25, maxDistance: 8, maxPolarAngle: Math.PI * 0.52 });
    this.pictures = new Pictures(canvas, () => true, () => this.draw());
    this.controls.addEventListener("change", () => this.pictures.ask());
    new ResizeObserver(() => this.fit()).observe(canvas);
    canvas.addEventListener("keydown", (event) => this.key(event));
  }

  /** Take what an avatar's file holds. Rejects where it is none. */
  async load(data: ArrayBuffer): Promise<void> {
    const scene = await readGlb(data);
    scene.traverse((node) => {
      if (!(node instanceof SkinnedMesh)) return;
      node.frustumCulled = false;
      node.castShadow = node.receiveShadow = true;
      this.meshes.push(node);
    });
    this.ownMaterials = this.meshes.map((mesh) => mesh.material);
    const primitives: Primitives | undefined = scene.userData.primitives;
    if (primitives) this.shapes = shapesOn((joint) => this.bones[joint]!, primitives);
    this.scene.add(scene);
    this.pictures.ask();
  }

  /** Names of the face's shapes that change something. */
  get faceShapes(): string[] {
    const of = this.meshes[0];
    const targets = of?.geometry.morphAttributes.position;
    const names = Object.entries(of?.morphTargetDictionary ?? {});
    return names.filter(([, n]) => targets?.[n]?.array.some((x) => x !== 0)).map(([name]) => name);
  }

  /** share: of a shape of the face, 0 to 1. */
  express(name: string, share: number): void {
    for (const { morphTargetDictionary: at, morphTargetInfluences: shares } of this.meshes) {
      if (at && shares && name in at) shares[at[name]!] = share;
    }
    this.pictures.ask();
  }

  pose({ positions, rotations }: Pose): void {
    this.bones.forEach((bone, j) => {
      bone.position.fromArray(positions[j]!);
      bone.quaternion.fromArray(rotations[j]!);
    });
    this.pictures.ask();
  }

  show(what: "bones" | "shapes" | "grey", seen: boolean): void {
    if (what === "bones") this.lines.visible = seen;
    else if (what === "shapes") for (const shape of this.shapes) shape.visible = seen;
    else this.meshes.forEach((mesh, n) => (mesh.material = seen ? GREY : this.ownMaterials[n]!));
    this.pictures.ask();
  }

  /** Look from there, at where the figure is now. */
  look(view: View): void {
    this.scene.updateMatrixWorld(true);
    const at = (name: string) => this.bones[this.joints.indexOf(name)]!.getWorldPosition(new Vector3());
    const head = at("head").add(new Vector3(0, 0.03, 0));
    const [left, right] = [at("left_hand"), at("right_hand")];
    const all = this.bones.map((bone) => bone.getWorldPosition(new Vector3()));
    const high = Math.max(...all.map((p) => p.y)) + 0.2;
    const wide = Math.max(...all.map((p) => Math.hypot(p.x, p.z))) * 2 + 0.3;
    const aspect = Math.min(1, this.camera.aspect);
    const away = (size: number) => size / 2 / Math.tan((FIELD / 2) * (Math.PI / 180)) / aspect;
    const [target, distance, angle, up] = {
      whole: [new Vector3(0, high / 2, 0), away(Math.max(high, wide * aspect)) * 1.12, 0.35, 0.08],
      behind: [new Vector3(0, high / 2, 0), away(Math.max(high, wide * aspect)) * 1.12, Math.PI - 0.35, 0.08],
      face: [head, away(0.44), 0.3, 0.04],
      hands: [left.clone().add(right).multiplyScalar(0.5), away(Math.max(0.35, left.distanceTo(right) + 0.3)), 0.2, 0.35],
    }[view] as [Vector3, number, number, number];
    this.controls.target.copy(target);
    this.camera.position.setFromSphericalCoords(distance, Math.PI / 2 - up, angle).add(target);
    this.controls.update();
    this.pictures.ask();
  }

  /** Where joints are [m]. */
  places(): [number, number, number][] {
    this.scene.updateMatrixWorld(true);
    return this.bones.map((bone) => bone.getWorldPosition(new Vector3()).toArray());
  }

  private get bones() {
    return this.meshes[0]?.skeleton.bones ?? [];
  }

  private draw(): boolean {
    if (this.lines.visible) {
      this.scene.updateMatrixWorld(true);
      const ends = this.bones.flatMap((bone, j) => (j ? [bone, bone.parent!] : []));
      this.lines.geometry.setFromPoints(ends.map((bone) => bone.getWorldPosition(new Vector3())));
    }
    this.renderer.render(this.scene, this.camera);
    this.drawn++;
    return false;
  }

  private fit(): void {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (!width || !height) return;
    this.renderer.setPixelRatio(Math.min(2, devicePixelRatio));
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.pictures.ask();
  }

  private key(event: KeyboardEvent): void {
    if (orbitedByKey(event, this.camera, this.controls)) this.controls.update();
  }
}
