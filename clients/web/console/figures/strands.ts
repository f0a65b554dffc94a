// Light that hair mirrors in bands across its strands, as the renderers have it (vistel/render/shaders/strands.glsl).
import { type Group, Mesh, MeshStandardMaterial } from "three";

const OF_PATCH = /^patch (\d+)$/; // names of materials in an avatar's file
const FLAG = 13; // among a patch's numbers: it is of strands

const LIGHT = `#include <lights_physical_pars_fragment>
vec3 strandAlong(const in vec3 n) {
  vec3 px = dFdx(-vViewPosition), py = dFdy(-vViewPosition);
  vec3 way = cross(n, py) * dFdx(vMapUv.y) + cross(px, n) * dFdy(vMapUv.y); // towards the root; v goes down in files
  float size = dot(way, way);
  return size > 0.0 ? way * inversesqrt(size) : vec3(0.0, 1.0, 0.0);
}
float strandLobe(const in vec3 t, const in vec3 h, const in float power) {
  float c = dot(t, h);
  return pow(max(1.0 - c * c, 0.0), 0.5 * power);
}
void RE_Direct_Strands(const in IncidentLight directLight, const in vec3 geometryPosition, const in vec3 geometryNormal, const in vec3 geometryViewDir, const in vec3 geometryClearcoatNormal, const in PhysicalMaterial material, inout ReflectedLight reflectedLight) {
  RE_Direct_Physical(directLight, geometryPosition, geometryNormal, geometryViewDir, geometryClearcoatNormal, material, reflectedLight);
  vec3 base = material.diffuseColor, h = normalize(directLight.direction + geometryViewDir), t = strandAlong(geometryNormal);
  float light = dot(base, vec3(0.333)), mean = dot(texture2D(map, vMapUv, 5.0).rgb, vec3(0.333));
  float uneven = 0.25 * clamp((light - mean) / (light + mean + 1e-4), -0.5, 0.5);
  float pale = strandLobe(normalize(t + (0.10 + uneven) * geometryNormal), h, 90.0);
  float own = strandLobe(normalize(t + (-0.12 + uneven) * geometryNormal), h, 18.0);
  float lit = clamp(0.2 + dot(geometryNormal, directLight.direction), 0.0, 1.0);
  reflectedLight.directSpecular += (0.04 * pale + 0.7 * own * base) * lit * directLight.color * RECIPROCAL_PI;
}
#undef RE_Direct
#define RE_Direct RE_Direct_Strands`;

/** Have the hair of a figure mirror so. patches: what VISTEL_avatar keeps of them. */
export function shine(scene: Group, patches: readonly { numbers: readonly number[] }[]): void {
  scene.traverse((node) => {
    if (!(node instanceof Mesh) || !(node.material instanceof MeshStandardMaterial) || !node.material.map) return;
    const number = OF_PATCH.exec(node.material.name)?.[1];
    if (number === undefined || !patches[Number(number)]?.numbers[FLAG]) return;
    node.material.onBeforeCompile = (shader) => {
      shader.fragmentShader = shader.fragmentShader.replace("#include <lights_physical_pars_fragment>", LIGHT);
    };
    node.material.customProgramCacheKey = () => "strands";
  });
}
