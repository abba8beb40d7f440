// Where a run takes place, and from where it is looked at first.
import * as THREE from 'three';

const kSamples = 64;      // times of each body
const kOutliers = 0.01;   // share of places at either end that may be out of the picture

function largest(body) {
  const {form} = body;
  if (form.kind === 'box') return Math.hypot(...form.half);
  if (form.kind === 'cylinder') return Math.hypot(form.radius, form.height / 2);
  if (form.kind === 'capsule') return form.radius + form.height / 2;
  return form.radius ?? body.radius ?? 0;
}

function* placesOf(run) {
  const pose = new Array(7);
  const step = Math.max(1, Math.ceil(run.bodies.length / 200));   // a thousand marbles need not all be asked
  const moving = run.bodies.filter((body) => body.form.kind !== 'plane' && run.tracks.moves(body.id) && body.id !== run.jello?.body);
  for (let index = 0; index < moving.length; index += step) {
    const body = moving[index];
    for (let sample = 0; sample <= kSamples; ++sample) {
      run.tracks.pose(body.id, sample / kSamples * run.duration, pose);
      yield [pose.slice(0, 3), largest(body)];
    }
  }
  const {jello} = run;
  if (!jello) return;
  const pictures = Math.max(1, Math.floor(jello.times.length / kSamples)), points = Math.max(1, Math.floor(jello.points / 64));
  for (let picture = 0; picture < jello.times.length; picture += pictures) {
    for (let point = 0; point < jello.points; point += points) {
      const at = 3 * (picture * jello.points + point);
      yield [Array.from(jello.positions.subarray(at, at + 3)), 0];
    }
  }
}

function allPlaces(run) {
  const places = [...placesOf(run)];
  if (places.length) return places;
  const still = run.bodies.filter((body) => body.form.kind !== 'plane').map((body) => [body.pose.slice(0, 3), largest(body)]);
  return still.length ? still : [[[0, 0, 0], 0.5]];
}

/// The ball that holds what moves, over the whole run: {centre, radius, box}.
export function boundsOf(run) {
  const places = allPlaces(run);
  const box = new THREE.Box3();
  const low = [0, 0, 0], high = [0, 0, 0];
  const size = Math.max(...places.map(([, radius]) => radius));
  for (let axis = 0; axis < 3; ++axis) {
    const sorted = places.map(([place]) => place[axis]).sort((a, b) => a - b);
    low[axis] = sorted[Math.floor(kOutliers * (sorted.length - 1))] - size;
    high[axis] = sorted[Math.ceil((1 - kOutliers) * (sorted.length - 1))] + size;
  }
  box.set(new THREE.Vector3(...low), new THREE.Vector3(...high));
  const centre = box.getCenter(new THREE.Vector3());
  return {centre, box, radius: Math.max(1e-4, 0.5 * box.getSize(new THREE.Vector3()).length())};
}

/// Away from gravity; without any, +y.
export function upOf(run) {
  const up = new THREE.Vector3(...run.gravity).negate();
  return up.lengthSq() > 1e-12 ? up.normalize() : new THREE.Vector3(0, 1, 0);
}

/// Points the camera so that the box fills the picture, seen from slightly above, along its shorter level side.
export function frame(camera, bounds, up) {
  const size = bounds.box.getSize(new THREE.Vector3());
  const sides = [new THREE.Vector3(1, 0, 0), new THREE.Vector3(0, 1, 0), new THREE.Vector3(0, 0, 1)]
      .filter((side) => Math.abs(side.dot(up)) < 0.7);
  const extent = (side) => Math.abs(side.dot(size));
  let ahead = sides.reduce((best, side) => extent(side) < 0.8 * extent(best) ? side : best, sides[sides.length - 1]).clone();
  ahead.addScaledVector(up, -ahead.dot(up)).normalize();
  const aside = up.clone().cross(ahead);
  const way = ahead.addScaledVector(aside, 0.42).addScaledVector(up, 0.42).normalize();
  camera.up.copy(up);
  camera.position.copy(bounds.centre).addScaledVector(way, bounds.radius);
  camera.lookAt(bounds.centre);
  camera.updateMatrixWorld();
  const distance = fittingDistance(camera, bounds, way);
  camera.position.copy(bounds.centre).addScaledVector(way, distance);
  camera.near = 0.01 * bounds.radius;
  camera.far = 60 * bounds.radius + 2 * distance;
}

/// How far from the centre, along `way`, every corner of the box is within the picture with a margin.
function fittingDistance(camera, bounds, way) {
  const tall = Math.tan(camera.fov * Math.PI / 360) * 0.8, wide = tall * camera.userData.aspect;
  const right = new THREE.Vector3().setFromMatrixColumn(camera.matrixWorld, 0);
  const above = new THREE.Vector3().setFromMatrixColumn(camera.matrixWorld, 1);
  let distance = 0;
  for (let corner = 0; corner < 8; ++corner) {
    const {min, max} = bounds.box;
    const at = new THREE.Vector3(corner & 1 ? max.x : min.x, corner & 2 ? max.y : min.y, corner & 4 ? max.z : min.z).sub(bounds.centre);
    distance = Math.max(distance, at.dot(way) + Math.max(Math.abs(at.dot(right)) / wide, Math.abs(at.dot(above)) / tall));
  }
  return distance;
}
