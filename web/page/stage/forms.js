// Geometry of each form, and the textures that let a turning be seen.
import * as THREE from 'three';
import {mergeVertices, toCreasedNormals} from 'three/examples/jsm/utils/BufferGeometryUtils.js';

const kCrease = 0.6;  // rad between faces above which an edge is sharp

function alongAxis(geometry, axis) {
  if (axis === 0) geometry.rotateZ(-Math.PI / 2);
  if (axis === 2) geometry.rotateX(Math.PI / 2);
  return geometry;
}

function meshGeometry({points, triangles}) {
  const plain = new THREE.BufferGeometry();
  plain.setAttribute('position', new THREE.BufferAttribute(points, 3));
  plain.setIndex(new THREE.BufferAttribute(triangles, 1));
  return toCreasedNormals(mergeVertices(plain), kCrease);
}

/// What bodies of like form share: a geometry of size one, and the scale that makes it the body's.
export function sharedForm(form, radius) {
  if (form.kind === 'sphere') return {key: 'sphere', scale: [form.radius, form.radius, form.radius]};
  if (form.kind === 'box') return {key: 'box', scale: form.half};
  if (form.kind === 'cylinder') {
    const scale = [form.radius, form.radius, form.radius];
    scale[form.axis ?? 1] = form.height;
    return {key: `cylinder ${form.axis ?? 1}`, scale};
  }
  if (form.kind === 'capsule') return {key: `capsule ${form.axis ?? 1} ${form.radius} ${form.height}`, scale: [1, 1, 1]};
  if (form.kind === 'mesh') return {key: `mesh ${form.mesh}`, scale: [1, 1, 1]};
  if (form.kind === 'unknown') return {key: 'unknown', scale: Array(3).fill(radius || 0.01)};
  return null;
}

export function geometryOf(form, meshes, fine) {
  switch (form.kind) {
    case 'sphere': return new THREE.SphereGeometry(1, fine ? 48 : 20, fine ? 32 : 14);
    case 'box': return new THREE.BoxGeometry(2, 2, 2);
    case 'cylinder': return alongAxis(new THREE.CylinderGeometry(1, 1, 1, 48), form.axis ?? 1);
    case 'capsule': return alongAxis(new THREE.CapsuleGeometry(form.radius, form.height, 12, 32), form.axis ?? 1);
    case 'mesh': return meshGeometry(meshes[form.mesh]);
    default: return new THREE.OctahedronGeometry(1);
  }
}

/// The seam of a tennis ball, which shows a turning about any axis, on white: the body's colour is multiplied in.
export function seamTexture() {
  const canvas = document.createElement('canvas');
  canvas.width = 1024;
  canvas.height = 512;
  const pen = canvas.getContext('2d');
  pen.fillStyle = '#fff';
  pen.fillRect(0, 0, 1024, 512);
  const seam = (width, style) => {
    pen.strokeStyle = style;
    pen.lineWidth = width;
    pen.beginPath();
    for (let x = -20; x <= 1044; x += 4) {
      pen.lineTo(x, 256 - 118 * Math.sin(2 * Math.PI * 2 * x / 1024));
    }
    pen.stroke();
  };
  seam(64, '#8f9299');
  seam(30, '#5d6068');
  const texture = new THREE.CanvasTexture(canvas);
  texture.colorSpace = THREE.SRGBColorSpace;
  texture.wrapS = THREE.RepeatWrapping;
  texture.anisotropy = 4;
  return texture;
}

/// Lengths of material that a cylinder's turning shows by: a faint band along one side.
export function bandTexture() {
  const canvas = document.createElement('canvas');
  canvas.width = 256;
  canvas.height = 16;
  const pen = canvas.getContext('2d');
  pen.fillStyle = '#fff';
  pen.fillRect(0, 0, 256, 16);
  pen.fillStyle = '#c4c6cb';
  pen.fillRect(0, 0, 64, 16);
  pen.fillRect(128, 0, 64, 16);
  const texture = new THREE.CanvasTexture(canvas);
  texture.colorSpace = THREE.SRGBColorSpace;
  return texture;
}

/// A coil along +y, `length` long at rest.
export function coilGeometry(turns, length, radius, wire) {
  class Coil extends THREE.Curve {
    getPoint(part, target = new THREE.Vector3()) {
      const taper = Math.min(1, 12 * part, 12 * (1 - part));
      const angle = 2 * Math.PI * turns * part;
      return target.set(radius * taper * Math.cos(angle), length * part, radius * taper * Math.sin(angle));
    }
  }
  return new THREE.TubeGeometry(new Coil(), turns * 20, wire, 6);
}
