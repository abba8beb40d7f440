// A soft glow where bodies have just met, and the ring about what is selected.
import * as THREE from 'three';

const kGlows = 48;
const kLasts = 0.16;   // s of the watch, at any speed

const kVertex = `
  attribute float size;
  attribute float glow;
  attribute vec3 tint;
  varying float shine;
  varying vec3 colour;
  uniform float scale;
  void main() {
    vec4 seen = modelViewMatrix * vec4(position, 1.0);
    seen.xyz *= 0.97;
    shine = glow;
    colour = tint;
    gl_PointSize = clamp(size * scale / -seen.z, 2.0, 400.0);
    gl_Position = projectionMatrix * seen;
  }`;
const kFragment = `
  varying float shine;
  varying vec3 colour;
  uniform vec3 glowTint;
  void main() {
    float from = length(gl_PointCoord - 0.5) * 2.0;
    float ring = exp(-pow((from - 0.72 * (1.0 - 0.6 * shine)) * 9.0, 2.0));
    float core = exp(-from * from * 9.0);
    float light = shine * (0.4 * ring + 0.9 * core) * smoothstep(1.0, 0.85, from);
    gl_FragColor = vec4(mix(colour, glowTint, 0.6), light);
    #include <colorspace_fragment>
  }`;

export class Impacts {
  constructor(run, bounds, looks) {
    this.run = run;
    this.measure();
    this.reach = 0.09 * bounds.radius;
    this.geometry = new THREE.BufferGeometry();
    for (const [name, width] of [['position', 3], ['size', 1], ['glow', 1], ['tint', 3]]) {
      this.geometry.setAttribute(name, new THREE.BufferAttribute(new Float32Array(width * kGlows), width).setUsage(THREE.DynamicDrawUsage));
    }
    this.material = new THREE.ShaderMaterial({
      vertexShader: kVertex, fragmentShader: kFragment, transparent: true, depthWrite: false,
      uniforms: {scale: {value: 1}, glowTint: {value: new THREE.Color()}},
    });
    this.group = new THREE.Points(this.geometry, this.material);
    this.group.frustumCulled = false;
    this.group.renderOrder = 5;
    this.looks = looks;
  }

  /// Looks for the loudest event, beside which the others are drawn; again when there are more.
  measure() {
    this.loudest = this.run.events.reduce((most, event) => Math.max(most, event.level), -Infinity);
  }
  /// The index of the first event after a time.
  #after(time) {
    let low = 0, high = this.run.events.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.run.events[middle].time <= time) low = middle + 1; else high = middle;
    }
    return low;
  }

  update(time, speed, height) {
    const {position, size, glow, tint} = this.geometry.attributes;
    const lasts = kLasts * Math.max(speed, 0.002);
    let count = 0;
    for (let index = this.#after(time) - 1; index >= 0 && count < kGlows; --index) {
      const event = this.run.events[index], age = (time - event.time) / lasts;
      if (age > 1) break;
      const loud = Math.max(0, 1 + (event.level - this.loudest) / 50);
      if (loud <= 0) continue;
      position.setXYZ(count, ...event.position);
      size.setX(count, this.reach * (0.4 + 0.6 * loud) * (0.5 + age));
      glow.setX(count, loud * (1 - age) ** 2);
      tint.setXYZ(count, 1, 1, 1);
      ++count;
    }
    this.geometry.setDrawRange(0, count);
    this.material.uniforms.scale.value = height;
    for (const attribute of [position, size, glow, tint]) attribute.needsUpdate = true;
  }
  paint(theme) {
    this.material.uniforms.glowTint.value.set(theme.glow);
    this.material.blending = theme.dark ? THREE.AdditiveBlending : THREE.NormalBlending;
  }
}
