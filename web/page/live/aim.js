// Where a pointer of the page points to in the scene.
import * as THREE from 'three';

const kClear = 1.02;     // radii between a body and a plane
const kNear = 3;         // radii from the eye to what is thrown

/// Planes that nothing is behind of, as {normal, offset}: all x with normal.x >= offset.
function wallsOf(run) {
  return run.bodies.filter((body) => body.form.kind === 'plane').map(({pose, form}) => {
    const [x, y, z, qw, qx, qy, qz] = pose;
    const normal = new THREE.Vector3(...form.normal).applyQuaternion(new THREE.Quaternion(qx, qy, qz, qw)).normalize();
    return {normal, offset: form.offset + normal.dot(new THREE.Vector3(x, y, z))};
  });
}

/// The part of a ray that is at least `clear` before all planes: [from, to] in m, or null.
function inside(ray, walls, clear) {
  let from = 0, to = Infinity;
  for (const {normal, offset} of walls) {
    const slope = normal.dot(ray.direction), gap = normal.dot(ray.origin) - offset - clear;
    if (Math.abs(slope) < 1e-9) {
      if (gap < 0) return null;
    } else if (slope > 0) from = Math.max(from, -gap / slope);
    else to = Math.min(to, -gap / slope);
  }
  return to > from ? [from, to] : null;
}

/// Where a thrown body begins: near the eye, but before all planes. Throws a sentence if there is no room.
export function throwFrom(stage, ray, radius) {
  const part = inside(ray, wallsOf(stage.run), kClear * radius);
  const near = Math.max(kNear * radius, 2 * stage.camera.near);
  if (!part || part[1] < near) throw new Error('There is no room for it that way.');
  return ray.at(Math.max(near, part[0]), new THREE.Vector3());
}

/// The point that is pointed at: of a body, of a plane, or in the middle of the scene.
export function pointedAt(stage, x, y) {
  const ray = stage.ray(x, y), hit = stage.pickPoint(x, y);
  const part = inside(ray, wallsOf(stage.run), 0);
  if (hit && (!part || hit.point.distanceTo(ray.origin) < part[1])) return hit.point.clone();
  if (part && part[1] < 20 * stage.bounds.radius) return ray.at(part[1], new THREE.Vector3());
  return facing(stage, ray, stage.bounds.centre);
}

/// Where a ray meets the plane through a point that faces the eye.
export function facing(stage, ray, point) {
  const normal = stage.camera.getWorldDirection(new THREE.Vector3());
  const along = normal.dot(point.clone().sub(ray.origin)) / normal.dot(ray.direction);
  return ray.at(Math.max(0, along), new THREE.Vector3());
}

/// Keeps a place before all planes, as far as it is behind of them.
export function keptInside(stage, place, radius) {
  for (let round = 0; round < 2; ++round) {
    for (const {normal, offset} of wallsOf(stage.run)) {
      const gap = normal.dot(place) - offset - kClear * radius;
      if (gap < 0) place.addScaledVector(normal, -gap);
    }
  }
  return place;
}
