// A run as the page draws it: bodies, tracks of their poses, events, contacts, from the manifest's blobs.
import {contactOf, kContactWidth} from './contacts.js';
import {EventList, kEventWidth} from './events.js';
import {kPoseWidth, Tracks} from './tracks.js';

const kListenerWidth = 8;

function doubles(bytes) {
  return bytes ? new Float64Array(bytes.buffer, bytes.byteOffset, bytes.byteLength >> 3) : new Float64Array(0);
}

/// A table comes as planes, which pack better: byte after byte of its rows, each XOR that of the row above.
function tableOf(bytes, columns, Type) {
  if (!bytes?.length) return new Type(0);
  const width = columns * Type.BYTES_PER_ELEMENT, rows = Math.floor(bytes.length / width);
  const out = new Uint8Array(rows * width);
  for (let place = 0, at = 0; place < width; ++place) {
    for (let row = 0, value = 0; row < rows; ++row) {
      value ^= bytes[at++];
      out[row * width + place] = value;
    }
  }
  return new Type(out.buffer);
}

/// Events in order of time, with the two rows of one collision as one event.
export function readEvents(bytes) {
  const list = new EventList();
  list.add(tableOf(bytes, kEventWidth, Float64Array));
  return list.events;
}

function readContacts(bytes) {
  const table = tableOf(bytes, kContactWidth, Float64Array);
  return Array.from({length: Math.floor(table.length / kContactWidth)}, (none, row) => contactOf(table, row * kContactWidth));
}

function readMesh(mesh, bytes) {
  return {points: new Float32Array(bytes.buffer, bytes.byteOffset, 3 * mesh.vertices),
          triangles: new Uint32Array(bytes.buffer, bytes.byteOffset + 12 * mesh.vertices, 3 * mesh.triangles)};
}

/// A copy, as doubles inside the blob need not lie at a multiple of eight bytes.
function cut(bytes, Type, offset, count) {
  const size = count * Type.BYTES_PER_ELEMENT;
  return new Type(bytes.slice(offset, offset + size).buffer);
}

function readJello(jello, bytes) {
  const edgeEnd = 8 * jello.edges, triangleEnd = edgeEnd + 12 * jello.triangles;
  const timeEnd = triangleEnd + 8 * jello.pictures;
  return {
    body: jello.body, points: jello.points,
    edges: cut(bytes, Uint32Array, 0, 2 * jello.edges),
    triangles: cut(bytes, Uint32Array, edgeEnd, 3 * jello.triangles),
    times: cut(bytes, Float64Array, triangleEnd, jello.pictures),
    positions: cut(bytes, Float32Array, timeEnd, 3 * jello.points * jello.pictures),
  };
}

/// The pose of a listener, from its path if it has one: x y z, w x y z.
export function listenerPose(listener, time) {
  const path = listener.track;
  if (!path?.length) return [...listener.position, ...(listener.orientation ?? [1, 0, 0, 0])];
  let low = 0, high = path.length / kListenerWidth - 1;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (path[middle * kListenerWidth] <= time) low = middle; else high = middle;
  }
  const begin = path[low * kListenerWidth], end = path[high * kListenerWidth];
  const part = end > begin ? Math.min(1, Math.max(0, (time - begin) / (end - begin))) : 0;
  const pose = new Array(7);
  for (let item = 0; item < 7; ++item) {
    const from = path[low * kListenerWidth + 1 + item], to = path[high * kListenerWidth + 1 + item];
    pose[item] = from + part * (to - from);
  }
  const length = Math.hypot(...pose.slice(3)) || 1;
  for (let item = 3; item < 7; ++item) pose[item] /= length;
  return pose;
}

async function readListeners(listeners, blobs) {
  return Promise.all((listeners ?? []).map(async (listener, index) => ({
    ...listener, index, name: listener.name || `listener ${index + 1}`, track: doubles(await blobs.get(listener.path)),
  })));
}

/// Everything of one run that is drawn. The sound's blob is left packed until it is wanted.
export async function readRun(run, index, blobs) {
  const [events, poses, contacts, jello] = await Promise.all(
      [run.events?.blob, run.poses?.blob, run.contacts?.blob, run.jello?.blob].map((blob) => blobs.get(blob)));
  const meshes = await Promise.all((run.meshes ?? []).map(async (mesh) => readMesh(mesh, await blobs.get(mesh.blob))));
  const bodies = run.bodies.map((body) => ({...body, name: body.name || `body ${body.id}`}));
  return {
    ...run, index, bodies, meshes, events: readEvents(events), contacts: readContacts(contacts),
    tracks: new Tracks(bodies, tableOf(poses, kPoseWidth, Float32Array)), byId: new Map(bodies.map((body) => [body.id, body])),
    jello: run.jello && jello ? readJello(run.jello, jello) : null, listeners: await readListeners(run.listeners, blobs),
    links: run.links ?? [], gravity: run.gravity ?? [0, -9.81, 0],
    soundBytes: () => blobs.joined(run.sound), hasSound: run.sound !== undefined && run.sound !== null,
  };
}

/// The two bodies of an event, the one that moves first; -1 for none.
export function sidesOf(run, event) {
  const stays = (id) => id < 0 || !run.byId.get(id)?.moves;
  return stays(event.body) && !stays(event.other) ? [event.other, event.body] : [event.body, event.other];
}

/// Their names: "marble 3", "floor"; null for a second that is not known.
export function namesOf(run, event) {
  const [one, two] = sidesOf(run, event);
  const name = (id) => run.byId.get(id)?.name ?? (id < 0 ? 'the world' : `body ${id}`);
  return [name(one), two < 0 ? null : name(two)];
}
