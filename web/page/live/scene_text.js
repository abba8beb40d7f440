// A scene as it is now, as JSON (docs/scenes.md): what it began with, groups expanded into single bodies with their
// states, what was added, and the settings as they were changed.

const kStateWidth = 14;
const kWalls = [['left', 0, 1], ['right', 0, -1], ['bottom', 1, 1], ['top', 1, -1], ['back', 2, 1], ['front', 2, -1]];

function axisAngle([w, x, y, z]) {
  const sine = Math.hypot(x, y, z);
  if (sine < 1e-12) return null;
  return {axis: [x, y, z].map((part) => part / sine), angle: 2 * Math.atan2(sine, w) * 180 / Math.PI};
}
function times(vector, factor) {
  return vector.map((part) => part * factor);
}
function plus(one, two) {
  return one.map((part, axis) => part + two[axis]);
}
/// Nine digits are more than a picture or a sound can tell apart.
function rounded(vector) {
  return vector.map((part) => Number(part.toPrecision(9)));
}

/// The states of moving bodies, by body.
function statesOf(table) {
  const states = new Map();
  for (let at = 0; at + kStateWidth <= table.length; at += kStateWidth) {
    const row = Array.from(table.subarray(at, at + kStateWidth));
    states.set(row[0], {position: row.slice(1, 4), orientation: row.slice(4, 8), velocity: row.slice(8, 11), spin: row.slice(11, 14)});
  }
  return states;
}

/// The material of one sphere of a group, which may be one of several.
function materialOf(choice, name) {
  if (!Array.isArray(choice)) return choice;
  return choice.find((item) => item === name) ?? choice.find((item) => typeof item === 'object') ?? choice[0];
}

/// The bodies of one entry, each as an entry of its own, in the order of their ids.
function expanded(entry, bodies) {
  const {type, name, count, min, max, radius, material, speed, ...rest} = entry;
  if (type === 'box') {
    return kWalls.map(([side, axis, way], wall) => {
      const normal = [0, 0, 0], point = [0, 0, 0];
      normal[axis] = way;
      point[axis] = way > 0 ? min[axis] : max[axis];
      return {type: 'plane', name: bodies[wall].name, normal, point, material, ...rest};
    });
  }
  if (type !== 'spheres') return [{...entry, name: bodies[0].name}];
  return bodies.map((body) => ({type: 'sphere', name: body.name, radius: body.form.radius, material: materialOf(material, body.material),
                                position: [0, 0, 0], ...rest}));
}
function countOf(entry) {
  return entry.type === 'box' ? kWalls.length : entry.type === 'spheres' ? entry.count : 1;
}

/// Puts a body's state into its entry.
function put(entry, state) {
  entry.position = state.position;
  entry.velocity = state.velocity;
  entry.spin = state.spin;
  if (entry.type === 'sphere') return;
  delete entry.rotation;
  const rotation = axisAngle(state.orientation);
  if (rotation) entry.rotation = rotation;
}
/// The points of a jello, in the place of its pose.
function putJello(entry, numbers) {
  const points = Array.from({length: numbers.length / 3}, (none, point) => rounded(Array.from(numbers.subarray(3 * point, 3 * point + 3))));
  for (const key of ['position', 'rotation', 'velocity', 'spin']) delete entry[key];
  entry.positions = points.slice(0, points.length / 2);
  entry.velocities = points.slice(points.length / 2);
}
/// What nothing can push, but what moves by itself, goes on from where it is.
function moveSurface(entry, time) {
  const {velocity, oscillation} = entry;
  if (velocity && entry.type === 'plane') {
    if (entry.point) entry.point = plus(entry.point, times(velocity, time));
    else entry.offset += time * velocity.reduce((sum, part, axis) => sum + part * entry.normal[axis], 0) / Math.hypot(...entry.normal);
  } else if (velocity && entry.type === 'block') {
    for (const corner of ['min', 'max']) entry[corner] = plus(entry[corner], times(velocity, time));
  }
  if (oscillation) entry.oscillation = {...oscillation, phase: ((oscillation.phase ?? 0) + 2 * Math.PI * oscillation.frequency * time) % (2 * Math.PI)};
}

/// Gives all bodies a coefficient of restitution: materials of their own names, like those they had.
function setRestitution(scene, entries, restitution) {
  delete scene.restitutions;
  for (const entry of entries) {
    if (entry.material === undefined) continue;
    if (typeof entry.material === 'object') {
      entry.material = {...entry.material, restitution};
      continue;
    }
    const like = entry.material.replace(/ \(live\)$/, ''), name = `${like} (live)`;
    scene.materials = {...scene.materials, [name]: {like, restitution}};
    entry.material = name;
  }
}

/// `run` has the bodies as they are drawn, `time` is the head's.
export function sceneText(journal, run, {states, jello, time}) {
  const scene = structuredClone(journal.scene), table = statesOf(states);
  const {gravity, stepper, step} = journal.settings;
  const entries = [];
  let body = 0;
  for (const entry of scene.bodies) {
    const count = countOf(entry);
    entries.push(...expanded(entry, run.bodies.slice(body, body + count)));
    body += count;
  }
  for (const change of journal.changes) {
    if (change.materials) scene.materials = {...scene.materials, ...change.materials};
    if (change.body) entries.push({...structuredClone(change.body), name: run.byId.get(change.id).name});
    if (change.set?.restitution !== undefined) setRestitution(scene, entries, change.set.restitution);
    if (change.set?.friction !== undefined) entries.filter(({type}) => type !== 'jello').forEach((entry) => entry.friction = change.set.friction);
  }
  entries.forEach((entry, id) => {
    if (table.has(id)) put(entry, table.get(id));
    else if (entry.type === 'jello') putJello(entry, jello);
    else moveSurface(entry, time);
  });
  scene.bodies = entries;
  scene.gravity = gravity;
  scene.stepper = {...scene.stepper, type: stepper, ...(stepper === 'bullet' ? {step} : {})};
  if (stepper !== 'bullet') for (const key of ['step', 'tuned']) delete scene.stepper[key];
  moveListeners(scene, time);
  return scene;
}

/// Listeners that are on their way go on from the pose that they have passed last.
function moveListeners(scene, time) {
  for (const listener of scene.listeners ?? []) {
    if (!listener.path) continue;
    const passed = listener.path.filter((pose) => pose.time <= time).at(-1);
    const left = listener.path.filter((pose) => pose.time > time).map((pose) => ({...pose, time: pose.time - time}));
    if (passed) Object.assign(listener, {...passed});
    delete listener.time;
    if (left.length) listener.path = left; else delete listener.path;
  }
}
