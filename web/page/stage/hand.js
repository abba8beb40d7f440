// The hand that draws a body: a thread from where it holds to where it wants the body to be.
import * as THREE from 'three';

export class Hand {
  group = new THREE.Group();

  constructor(bounds) {
    this.ends = new THREE.BufferAttribute(new Float32Array(6), 3).setUsage(THREE.DynamicDrawUsage);
    this.material = new THREE.LineBasicMaterial({transparent: true, opacity: 0.9, depthTest: false});
    const line = new THREE.Line(new THREE.BufferGeometry().setAttribute('position', this.ends), this.material);
    this.knobMaterial = new THREE.MeshBasicMaterial({transparent: true, opacity: 0.9, depthTest: false});
    this.knob = new THREE.Mesh(new THREE.SphereGeometry(0.012 * bounds.radius, 16, 12), this.knobMaterial);
    line.frustumCulled = false;
    this.group.add(line, this.knob);
    this.group.renderOrder = 6;
    this.group.visible = false;
  }
  /// From a point of a body to a place; without them it is not seen.
  show(from, to) {
    this.group.visible = Boolean(from);
    if (!from) return;
    this.ends.setXYZ(0, ...from);
    this.ends.setXYZ(1, ...to);
    this.ends.needsUpdate = true;
    this.knob.position.set(...to);
  }
  paint(theme) {
    this.material.color.set(theme.accent);
    this.knobMaterial.color.set(theme.accent);
  }
}
