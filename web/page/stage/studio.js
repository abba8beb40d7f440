// The light that surfaces mirror: a room of soft boxes, as a formula in the shader. It takes the place of a picture of
// surroundings, which would cost seconds to prepare where there is no graphics hardware.
import * as THREE from 'three';

const shared = {
  studioUp: {value: new THREE.Vector3(0, 1, 0)}, studioKey: {value: new THREE.Vector3(0.4, 0.8, 0.4)},
  studioSky: {value: new THREE.Color()}, studioFloor: {value: new THREE.Color()}, studioLamp: {value: 1},
};

const kUniforms = `
  uniform vec3 studioUp, studioKey, studioSky, studioFloor;
  uniform float studioLamp, studioRough, studioMetal;
  vec3 studioLight(vec3 way, float rough) {
    float high = dot(way, studioUp);
    float soft = 0.12 + 0.75 * rough;
    vec3 light = mix(studioFloor, studioSky, smoothstep(-soft - 0.1, soft + 0.25, high));
    float lamp = smoothstep(0.90 - 0.5 * soft, 0.93 + 0.07 * soft, dot(way, studioKey));
    vec3 aside = normalize(cross(studioKey, studioUp));
    float strip = smoothstep(0.26 + soft * 0.5, 0.1, abs(dot(way, aside) + 0.72)) * smoothstep(-0.3, 0.2, high);
    return light + studioLamp * (1.0 - 0.75 * rough) * (lamp * vec3(1.6) + strip * vec3(0.42, 0.46, 0.52));
  }
`;
const kMirror = `
  {
    vec3 studioWay = inverseTransformDirection(reflect(-geometryViewDir, geometryNormal), viewMatrix);
    float studioFacing = saturate(dot(geometryNormal, geometryViewDir));
    float studioRim = pow(1.0 - studioFacing, 5.0) * (1.0 - 0.85 * studioRough);
    vec3 studioShare = mix(vec3(0.045), diffuseColor.rgb, studioMetal) * (1.0 - 0.5 * studioRough * (1.0 - studioMetal));
    studioShare += (vec3(1.0) - studioShare) * 0.6 * studioRim;
    totalEmissiveRadiance += studioShare * studioLight(studioWay, studioRough);
    #ifdef STUDIO_CLEAR
      diffuseColor.a = mix(diffuseColor.a, 1.0, 0.75 * pow(1.0 - studioFacing, 2.5));
    #endif
  }
`;

/// A surface that mirrors the studio: dull by Lambert's law, and a mirror of its roughness above that. `clear` ones are
/// denser at their rim, as glass is. Three's own physical material would take twice as long to compile.
export function studioMaterial({clear = false, roughness = 0.5, metalness = 0, ...options}) {
  const material = new THREE.MeshLambertMaterial(options);
  if (clear) material.defines = {STUDIO_CLEAR: ''};
  const own = {studioRough: {value: roughness}, studioMetal: {value: metalness}};
  material.onBeforeCompile = (shader) => {
    Object.assign(shader.uniforms, shared, own);
    shader.fragmentShader = shader.fragmentShader.replace('void main() {', `${kUniforms}\nvoid main() {`)
        .replace('#include <lights_lambert_fragment>', '#include <lights_lambert_fragment>\nmaterial.diffuseColor *= 1.0 - studioMetal;')
        .replace('#include <lights_fragment_end>', `#include <lights_fragment_end>\n${kMirror}`);
  };
  material.customProgramCacheKey = () => 'studio';
  return material;
}

export function setStudio({up, key, theme}) {
  if (up) shared.studioUp.value.copy(up);
  if (key) shared.studioKey.value.copy(key).normalize();
  if (!theme) return;
  shared.studioSky.value.set(theme.sky);
  shared.studioFloor.value.set(theme.bounce);
  shared.studioLamp.value = theme.lamp;
}
