// Light as the renderers have it (vistel/render/shaders/common.glsl): a key light from the roof, the window, sky and ground.
import {
  Color,
  CustomToneMapping,
  DirectionalLight,
  HemisphereLight,
  PCFSoftShadowMap,
  type Scene,
  ShaderChunk,

  Vector3,
  type WebGLRenderer,
} from "three";

const REFLECTED = 0.62 * Math.PI; // of the renderers' light, in three.js's units
const KEY = { towards: new Vector3(-0.527, 0.773, 0.353), light: [1.86, 1.74, 1.55] as const };
const FILL = { towards: new Vector3(-0.8, 0.3, -0.52), light: [0.42, 0.5, 0.62] as const };
const SKY = [0.5, 0.54, 0.6] as const;
const GROUND = [0.3, 0.25, 0.2] as const;
const MIDDLE = new Vector3(0, 0.8, 0); // of what throws shadows
const SHADOWED_M = 2.1; // round it

// The renderers' curve of the display (Narkowicz 2015), whose square root three.js then makes sRGB of.
ShaderChunk.tonemapping_pars_fragment = ShaderChunk.tonemapping_pars_fragment.replace(
  "vec3 CustomToneMapping( vec3 color ) { return color; }",
  `vec3 CustomToneMapping( vec3 c ) {
    vec3 seen = sqrt( clamp( c * ( 2.51 * c + 0.03 ) / ( c * ( 2.43 * c + 0.59 ) + 0.14 ), 0.0, 1.0 ) );
    return mix( pow( ( seen + 0.055 ) / 1.055, vec3( 2.4 ) ), seen / 12.92, vec3( lessThanEqual( seen, vec3( 0.04045 ) ) ) );
  }`,
);

const colour = (light: readonly [number, number, number]) => new Color().setRGB(...light).multiplyScalar(REFLECTED);

/** The key light, whose shadows can be turned off. */
export function lit(scene: Scene, renderer: WebGLRenderer): DirectionalLight {
  renderer.toneMapping = CustomToneMapping;
  renderer.shadowMap.enabled = true;
  renderer.shadowMap.type = PCFSoftShadowMap;
  const key = new DirectionalLight(colour(KEY.light), 1);
  key.position.copy(MIDDLE).addScaledVector(KEY.towards, 4);
  key.target.position.copy(MIDDLE);
  key.castShadow = true;
  key.shadow.mapSize.set(2048, 2048);
  key.shadow.radius = 3;
  key.shadow.bias = -0.0004;
  key.shadow.normalBias = 0.012;
  Object.assign(key.shadow.camera, {
    left: -SHADOWED_M,
    right: SHADOWED_M,
    top: SHADOWED_M,
    bottom: -SHADOWED_M,
    near: 1,
    far: 7,
  });
  const fill = new DirectionalLight(colour(FILL.light), 1);
  fill.position.copy(FILL.towards);
  scene.add(key, key.target, fill, new HemisphereLight(colour(SKY), colour(GROUND), 1));
  return key;
}

