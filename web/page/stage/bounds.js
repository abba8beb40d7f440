// Where a run takes place, and from where it is looked at first.
import * as THREE from 'three';

const kSamples = 64;      // times of each body
const kFill = 0.9;         // of the open part of the picture
const kLoud = 24;         // dB below the loudest event: what is quieter does not have to be seen
const kOutliers = 0.01;   // share of places at either end that may be out of the picture

function meshRadius(points) {
  let square = 0;
  for (let at = 0; at < points.length; at += 3) square = Math.max(square, points[at] ** 2 + points[at + 1] ** 2 + points[at + 2] ** 2);
  return Math.sqrt(square);
}

function largest(body, run) {
  const {form} = body;
  if (form.kind === 'mesh') return meshRadius(run.meshes[form.mesh].points);
  if (form.kind === 'box') return Math.hypot(...form.half);
  if (form.kind === 'cylinder') return Math.hypot(form.radius, form.height / 2);
  if (form.kind === 'capsule') return form.radius + form.height / 2;
  return form.radius ?? body.radius ?? 0;
}

/// Until when a body counts: what flies or rolls away after its last loud contact would make all else small.
function activeUntil(run) {
  const last = new Map(), margin = 0.06 * run.duration;
  const note = (body, time) => last.set(body, Math.max(time, last.get(body) ?? 0));
  const loud = run.events.reduce((most, event) => Math.max(most, event.level), -Infinity) - kLoud;
  for (const event of run.events) if (event.level > loud) [event.body, event.other].forEach((body) => note(body, event.time));
  for (const contact of run.contacts.filter((item) => item.slides)) [contact.body, contact.other].forEach((body) => note(body, contact.end));
  const whole = Math.max(0, ...last.values()) || run.duration;
  return (body) => Math.min(run.duration, (last.get(body) ?? whole) + margin);
}

function* placesOf(run) {
  const pose = new Array(7), ends = activeUntil(run);
  const step = Math.max(1, Math.ceil(run.bodies.length / 200));   // a thousand marbles need not all be asked
  const moving = run.bodies.filter((body) => body.form.kind !== 'plane' && run.tracks.moves(body.id) && body.id !== run.jello?.body);
  for (let index = 0; index < moving.length; index += step) {
    const body = moving[index];
    for (let sample = 0; sample <= kSamples; ++sample) {
      run.tracks.pose(body.id, sample / kSamples * ends(body.id), pose);
      yield [pose.slice(0, 3), largest(body, run)];
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
  const still = run.bodies.filter((body) => body.form.kind !== 'plane').map((body) => [body.pose.slice(0, 3), largest(body, run)]);
  return still.length ? still : [[[0, 0, 0], 0.5]];
}

/// Small things that stay, near those that move, belong into the picture: a plate, not a table.
function stillNear(run, centre, radius) {
  return run.bodies.filter((body) => body.form.kind !== 'plane' && !run.tracks.moves(body.id) && body.id !== run.jello?.body)
      .map((body) => [body.pose.slice(0, 3), largest(body, run)])
      .filter(([place, size]) => size < 1.2 * radius && new THREE.Vector3(...place).distanceTo(centre) < 2 * radius);
}

/// The ball that holds what moves, over the whole run: {centre, radius, box, places: [[x, y, z], radius] ...}.
export function boundsOf(run) {
  const places = allPlaces(run);
  const low = [0, 0, 0], high = [0, 0, 0];
  const size = Math.max(...places.map(([, radius]) => radius));
  for (let axis = 0; axis < 3; ++axis) {
    const sorted = places.map(([place]) => place[axis]).sort((a, b) => a - b);
    low[axis] = sorted[Math.floor(kOutliers * (sorted.length - 1))] - size;
    high[axis] = sorted[Math.ceil((1 - kOutliers) * (sorted.length - 1))] + size;
  }
  const box = new THREE.Box3(new THREE.Vector3(...low), new THREE.Vector3(...high));
  // Where everything begins has to be seen.
  for (const body of run.bodies.filter((item) => run.tracks.moves(item.id) && item.form.kind !== 'plane')) {
    const place = new THREE.Vector3(...run.tracks.pose(body.id, 0, new Array(7)).slice(0, 3)), radius = largest(body, run);
    box.expandByPoint(place.clone().addScalar(radius)).expandByPoint(place.addScalar(-radius));
  }
  const anchors = run.links.flatMap((link) => link.ends).filter((end) => end.body < 0).map((end) => [end.at, 0]);
  anchors.forEach(([place]) => box.expandByPoint(new THREE.Vector3(...place)));
  const within = [...places, ...anchors].filter(([place]) => box.containsPoint(new THREE.Vector3(...place)));
  const around = box.getSize(new THREE.Vector3()).length() / 2;
  within.push(...stillNear(run, box.getCenter(new THREE.Vector3()), around));
  return {centre: box.getCenter(new THREE.Vector3()), box, places: within, radius: Math.max(1e-4, around)};
}

/// Away from gravity; without any, +y.
export function upOf(run) {
  const up = new THREE.Vector3(...run.gravity).negate();
  return up.lengthSq() > 1e-12 ? up.normalize() : new THREE.Vector3(0, 1, 0);
}

/// The side from which the scene looks widest, turned a little, and slightly from above.
function wayTo(bounds, up) {
  const size = bounds.box.getSize(new THREE.Vector3());
  const sides = [new THREE.Vector3(1, 0, 0), new THREE.Vector3(0, 1, 0), new THREE.Vector3(0, 0, 1)]
      .filter((side) => Math.abs(side.dot(up)) < 0.7);
  const extent = (side) => Math.abs(side.dot(size));
  const ahead = sides.reduce((best, side) => extent(side) < 0.8 * extent(best) ? side : best, sides[sides.length - 1]).clone();
  ahead.addScaledVector(up, -ahead.dot(up)).normalize();
  const aside = up.clone().cross(ahead);
  return ahead.addScaledVector(aside, 0.36).addScaledVector(up, 0.36).normalize();
}

/// Points the camera so that what moves fills the open part of the picture. Returns what it looks at.
export function frame(camera, bounds, up) {
  const way = wayTo(bounds, up), target = bounds.centre.clone();
  const right = up.clone().cross(way).normalize(), above = way.clone().cross(right);
  const tall = Math.tan(camera.fov * Math.PI / 360) * kFill, wide = tall * camera.userData.aspect;
  let distance = 3 * bounds.radius;
  for (let round = 0; round < 6; ++round) {
    const spread = {left: 0, right: 0, low: 0, high: 0, least: 0};
    for (const [place, radius] of bounds.places) {
      const from = new THREE.Vector3(...place).sub(target), depth = Math.max(0.05 * distance, distance - from.dot(way));
      const x = from.dot(right), y = from.dot(above);
      spread.left = Math.min(spread.left, (x - radius) / depth);
      spread.right = Math.max(spread.right, (x + radius) / depth);
      spread.low = Math.min(spread.low, (y - radius) / depth);
      spread.high = Math.max(spread.high, (y + radius) / depth);
    }
    const {left, low} = spread;
    target.addScaledVector(right, (left + spread.right) / 2 * distance).addScaledVector(above, (low + spread.high) / 2 * distance);
    distance *= Math.max((spread.right - left) / 2 / wide, (spread.high - low) / 2 / tall);
    distance = Math.max(distance, 0.4 * bounds.radius);
  }
  camera.up.copy(up);
  camera.position.copy(target).addScaledVector(way, distance);
  camera.near = 0.01 * distance;
  camera.far = 60 * bounds.radius + 2 * distance;
  return target;
}
