// What is drawn beside bodies: rods and springs, the surface of jello, the room, listeners and the ear.
import * as THREE from 'three';
import {coilGeometry} from './forms.js';
import {rgbOfLch} from './colours.js';
import {studioMaterial} from './studio.js';
import {roomEdges} from './planes.js';
import {listenerPose} from '../run/data.js';

const kUp = new THREE.Vector3(0, 1, 0);
const kTurns = 12, kCoil = 6, kWire = 1.1;   // of a spring; its radii in those of a rod

/// Rods as thin cylinders, springs as coils, between ends that move with their bodies.
export class Links {
  group = new THREE.Group();
  #links = [];
  #pose = new Array(7);

  constructor(run, bounds) {
    this.run = run;
    const rod = new THREE.CylinderGeometry(1, 1, 1, 12).translate(0, 0.5, 0);
    this.material = studioMaterial({roughness: 0.4, metalness: 0.6});
    for (const item of run.links) {
      const spring = item.kind === 'spring';
      const ends = item.ends.map((end) => ({...end, radius: run.byId.get(end.body)?.radius ?? 0}));
      const thick = Math.max(0.0025 * bounds.radius, 0.06 * Math.max(...ends.map((end) => end.radius)));
      const link = {ends, thick, length: 1};
      if (spring) Object.assign(link, {thick: 1, length: this.#way(link, 0).length() || 1});
      link.mesh = new THREE.Mesh(spring ? coilGeometry(kTurns, link.length, kCoil * thick, kWire * thick) : rod, this.material);
      link.mesh.castShadow = true;
      this.group.add(link.mesh);
      this.#links.push(link);
    }
  }
  #way({ends}, time) {
    return this.#endAt(ends[1], time).sub(this.#endAt(ends[0], time));
  }
  #endAt(end, time) {
    const at = new THREE.Vector3(...end.at);
    if (end.body < 0) return at;
    const [x, y, z, qw, qx, qy, qz] = this.run.tracks.pose(end.body, time, this.#pose);
    return at.applyQuaternion(new THREE.Quaternion(qx, qy, qz, qw)).add(new THREE.Vector3(x, y, z));
  }
  update(time) {
    for (const link of this.#links) {
      const {mesh, ends, thick} = link, way = this.#way(link, time);
      const length = way.length() || 1e-9;
      mesh.position.copy(this.#endAt(ends[0], time));
      mesh.quaternion.setFromUnitVectors(kUp, way.divideScalar(length));
      mesh.scale.set(thick, length / link.length, thick);
    }
  }
  paint(theme) {
    this.material.color.set(theme.link);
  }
}

/// The surface of a lattice of jello, and its springs as faint lines.
export class Jello {
  group = new THREE.Group();

  constructor(jello, look) {
    this.jello = jello;
    this.points = new THREE.BufferAttribute(new Float32Array(3 * jello.points), 3).setUsage(THREE.DynamicDrawUsage);
    const [red, green, blue] = rgbOfLch(look.lch);
    const colour = new THREE.Color().setRGB(red / 255, green / 255, blue / 255, THREE.SRGBColorSpace);
    this.surface = new THREE.BufferGeometry();
    this.surface.setAttribute('position', this.points);
    this.surface.setIndex(new THREE.BufferAttribute(jello.triangles, 1));
    const mesh = new THREE.Mesh(this.surface, studioMaterial({
      clear: true, color: colour, roughness: 0.15, transparent: true, opacity: 0.7, side: THREE.DoubleSide,
      polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1}));
    mesh.castShadow = true;
    mesh.frustumCulled = false;
    mesh.userData.body = jello.body;
    const lattice = new THREE.BufferGeometry();
    lattice.setAttribute('position', this.points);
    lattice.setIndex(new THREE.BufferAttribute(jello.edges, 1));
    const lines = new THREE.LineSegments(lattice, new THREE.LineBasicMaterial({
      color: colour.clone().lerp(new THREE.Color(1, 1, 1), 0.45), transparent: true, opacity: 0.25}));
    lines.frustumCulled = false;
    this.mesh = mesh;
    this.group.add(mesh, lines);
  }
  /// The mean of the drawn points.
  middle() {
    const {array, count} = this.points, sum = [0, 0, 0];
    for (let at = 0; at < array.length; ++at) sum[at % 3] += array[at] / count;
    return sum;
  }
  /// The drawn point that is nearest to a place.
  nearest(place) {
    const {array} = this.points;
    let best = 0, least = Infinity;
    for (let at = 0; at < array.length; at += 3) {
      const far = Math.hypot(array[at] - place[0], array[at + 1] - place[1], array[at + 2] - place[2]);
      if (far < least) [best, least] = [at, far];
    }
    return Array.from(array.subarray(best, best + 3));
  }
  update(time) {
    const {times, positions, points} = this.jello;
    let low = 0, high = times.length - 1;
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (times[middle] <= time) low = middle; else high = middle;
    }
    const span = times[high] - times[low];
    const part = span > 0 ? Math.min(1, Math.max(0, (time - times[low]) / span)) : 0;
    const width = 3 * points, out = this.points.array;
    for (let item = 0; item < width; ++item) {
      out[item] = positions[low * width + item] + part * (positions[high * width + item] - positions[low * width + item]);
    }
    this.points.needsUpdate = true;
    this.surface.computeVertexNormals();
    this.surface.computeBoundingSphere();
  }
}

export class Room {
  group = new THREE.Group();
  constructor(room) {
    this.material = new THREE.LineBasicMaterial({transparent: true, opacity: 0.5});
    const edges = room ? roomEdges(room) : [];
    if (edges.length) this.group.add(new THREE.LineSegments(new THREE.BufferGeometry().setFromPoints(edges), this.material));
  }
  paint(theme) {
    this.material.color.set(theme.room);
  }
}

/// A head with two ears and a nose, or a microphone, of size one, that looks along -z.
function earModel(format, material) {
  const model = new THREE.Group();
  const part = (geometry, x, y, z, scale = [1, 1, 1]) => {
    const mesh = new THREE.Mesh(geometry, material);
    mesh.position.set(x, y, z);
    mesh.scale.set(...scale);
    model.add(mesh);
  };
  const ball = new THREE.SphereGeometry(1, 24, 16);
  if (format === 'mono') {
    part(ball, 0, 0, 0, [0.55, 0.55, 0.55]);
    part(new THREE.CylinderGeometry(0.38, 0.2, 1.5, 24), 0, -1, 0);
  } else if (format === 'pair') {
    part(ball, -0.9, 0, 0, [0.42, 0.42, 0.42]);
    part(ball, 0.9, 0, 0, [0.42, 0.42, 0.42]);
    part(new THREE.CylinderGeometry(0.1, 0.1, 1.8, 12).rotateZ(Math.PI / 2), 0, 0, 0);
  } else {
    part(ball, 0, 0, 0, [0.78, 1, 0.9]);
    part(ball, -0.8, 0, 0, [0.14, 0.34, 0.24]);
    part(ball, 0.8, 0, 0, [0.14, 0.34, 0.24]);
    part(new THREE.ConeGeometry(0.2, 0.45, 16).rotateX(-Math.PI / 2), 0, -0.05, -1.02);
  }
  return model;
}

/// The run's listeners, and the ear when it stays. Labels are elements of the page above the picture.
export class Listeners {
  group = new THREE.Group();
  constructor(run, bounds, labels) {
    this.run = run;
    this.labels = labels;
    this.size = 0.035 * bounds.radius;
    this.material = studioMaterial({roughness: 0.6});
    this.earMaterial = studioMaterial({roughness: 0.6});
    labels.replaceChildren();
    this.items = run.listeners.map((listener) => this.#item(listener.name, listener.format, this.material));
    this.ear = this.#item('ear', 'head', this.earMaterial);
  }
  #item(name, format, material) {
    const model = earModel(format, material);
    model.scale.setScalar(this.size);
    this.group.add(model);
    const label = document.createElement('span');
    label.textContent = name;
    this.labels.append(label);
    return {model, label};
  }
  #place({model, label}, pose, stage, shown, heard) {
    model.visible = shown;
    const [x, y, z, qw, qx, qy, qz] = pose;
    model.position.set(x, y, z);
    model.quaternion.set(qx, qy, qz, qw);
    const at = shown && stage.project(stage.above([x, y, z], 1.3 * this.size));
    // An ear at the eye itself would fill the picture.
    const near = shown && stage.camera.position.distanceTo(model.position) < 3 * this.size;
    if (near) model.visible = false;
    label.hidden = !at || at[2] > 1 || near;
    label.classList.toggle('heard', heard);
    if (!label.hidden) label.style.transform = `translate(${at[0].toFixed(1)}px, ${(at[1] - 3).toFixed(1)}px) translate(-50%, -100%)`;
  }
  update(time, stage, ear) {
    this.items.forEach((item, index) => {
      const heard = ear.mode === 'listener' && ear.listener === index;
      this.#place(item, listenerPose(this.run.listeners[index], time), stage, this.only === undefined || this.only === index, heard);
    });
    this.#place(this.ear, ear.pose, stage, ear.mode === 'stay', true);
  }
  paint(theme) {
    this.material.color.set(theme.listener);
    this.earMaterial.color.set(theme.accent);
  }
}
