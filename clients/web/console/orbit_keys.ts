// Keys that do what a hand does with OrbitControls: arrows turn, plus and minus come nearer and go back.
import { type PerspectiveCamera, Spherical } from "three";
import type { OrbitControls } from "three/addons/controls/OrbitControls.js";

const TURN = Math.PI / 24; // with one press of a key
const LEAST_POLAR = 0.05;
const TURNS: Record<string, [theta: number, phi: number, radius: number]> = {
  ArrowLeft: [-TURN, 0, 1],
  ArrowRight: [TURN, 0, 1],
  ArrowUp: [0, -TURN, 1],
  ArrowDown: [0, TURN, 1],
  "+": [0, 0, 0.9],
  "=": [0, 0, 0.9],
  "-": [0, 0, 1.1],
};

/** Whether the key moved the camera, within the limits of its controls. */
export function orbitedByKey(event: KeyboardEvent, camera: PerspectiveCamera, controls: OrbitControls): boolean {
  const turn = TURNS[event.key];
  if (!turn || !controls.enabled) return false;
  event.preventDefault();
  const place = new Spherical().setFromVector3(camera.position.clone().sub(controls.target));
  place.theta += turn[0];
  place.phi = Math.min(controls.maxPolarAngle, Math.max(LEAST_POLAR, place.phi + turn[1]));
  place.radius = Math.min(controls.maxDistance, Math.max(controls.minDistance, place.radius * turn[2]));
  camera.position.setFromSpherical(place).add(controls.target);
  return true;
}
