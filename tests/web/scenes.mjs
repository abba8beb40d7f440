// Scenes whose sound is compared between the module and this machine's library.
import {readFileSync} from 'node:fs';

import {CallList} from './call_list.mjs';

const kRate = 48000;
const kFloor = 0;
const kGravity = 9.81;

/// Numbers from 0 to 1 that look random (a linear congruence of 32 bits).
export function randomNumbers(seed) {
  let state = seed;
  return () => {
    state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
    return state / 2 ** 32;
  };
}

/// Begins a list: a sound on the simulation's clock with these listeners, and an immovable floor.
export function begin(layout, listeners, settings = {}) {
  const list = new CallList(layout);
  listeners.forEach((fields, index) => list.struct('carom_listener', `listener${index}`, fields));
  list.struct('carom_settings', 'settings', {
    listeners: '@listener0', listener_count: listeners.length, sample_rate: kRate,
    clock: 'CAROM_CLOCK_SIMULATION', level: 'CAROM_LEVEL_FIXED', latency: 0.01, ...settings,
  });
  list.call('carom_create', '@settings', '>sound');
  list.struct('carom_body', 'floor', {material: '"wood'});
  list.call('carom_set_body', '@sound', kFloor, '@floor');
  list.call('carom_prepare_rendering', '@sound', kRate);
  return list;
}

/// Advances and renders what is ready then.
export function advance(list, time, frames) {
  list.call('carom_advance', '@sound', time);
  if (frames > 0) list.add('render', '@sound', frames);
}

export function addBall(list, id, radius, fields = {}) {
  const mass = 7800 * 4 / 3 * Math.PI * radius ** 3;
  list.struct('carom_body', `body${id}`, {material: '"steel', mass, radius, ...fields});
  list.call('carom_set_body', '@sound', id, `@body${id}`);
  return mass;
}

/// A ball of this mass and radius lands on the floor.
export function landing(time, body, mass, radius, place, speed) {
  return {
    time, body, other: kFloor, impulse: [0, 1.6 * mass * speed, 0], normal: [0, 1, 0],
    position: place, approach_speed: speed, effective_mass: mass, radius, other_radius: 1e9,
    body_position: [place[0], place[1] + radius, place[2]], body_velocity: [0.1, -speed, 0.2],
  };
}

export function post(list, fields) {
  list.struct('carom_event', 'event', fields);
  list.call('carom_post', '@sound', '@event');
}

/// Posts landings of three balls all around, in steps of 10 ms, for a second.
function rain(list, seed, move = () => {}) {
  const random = randomNumbers(seed);
  const radii = [0.005, 0.012, 0.03];
  const masses = radii.map((radius, index) => addBall(list, index + 1, radius));
  for (let step = 1; step <= 100; ++step) {
    const kind = Math.floor(3 * random());
    const time = 0.01 * (step - random());
    const place = [4 * random() - 2, -1.2, 4 * random() - 2];
    if (step < 80)
      post(list, landing(time, kind + 1, masses[kind], radii[kind], place, 0.2 + 2 * random()));
    move(step);
    advance(list, 0.01 * step, step > 1 ? kRate / 100 : 0);
  }
}

function clicks(layout) {
  const list = begin(layout, [{position: [0.2, 0.3, 0.1]}]);
  rain(list, 1);
  return list;
}

function box(layout) {
  const list = begin(layout, [{position: [0.5, 0.8, 0.4]}]);
  const half = [0.1, 0.01, 0.05];
  const mass = 700 * 8 * half[0] * half[1] * half[2];
  list.struct('carom_body', 'box',
              {material: '"wood', mass, shape: 'CAROM_SHAPE_BOX', half_extents: half});
  list.call('carom_set_body', '@sound', 1, '@box');
  const random = randomNumbers(2);
  for (let step = 1; step <= 50; ++step) {
    const corner = [0.1 * (2 * random() - 1), 0, 0.05 * (2 * random() - 1)];
    const event = landing(0.01 * (step - 0.5), 1, 0.4 * mass, 0, corner, 0.5 + random());
    if (step < 40) post(list, {...event, body_position: [0, 0.01, 0], radius: 0.001});
    advance(list, 0.01 * step, step > 1 ? kRate / 100 : 0);
  }
  return list;
}

function ring(layout, files, settings = {}) {
  const list = begin(layout, [{position: [0.5, 0.8, 0.4]}], settings);
  list.add('file', 'model', files.model);
  list.call('carom_read_modes', '@model', readFileSync(files.model).length, '"block', '>modes');
  const mass = addBall(list, 1, 0.01);
  list.struct('carom_body', 'bell', {
    material: '"steel', mass: 6.24, shape: 'CAROM_SHAPE_BOX', half_extents: [0.1, 0.02, 0.05],
    modes: '@modes',
  });
  list.call('carom_set_body', '@sound', 2, '@bell');
  list.numbers('upright', 'f64', [0, 0, 0, 1]);
  const random = randomNumbers(3);
  for (let step = 1; step <= 100; ++step) {
    const time = 0.01 * step;
    if (step % 20 === 1) {
      const at = [0.15 * random() - 0.075, 0.02, 0.08 * random() - 0.04];
      const speed = 0.5 + random();
      const shared = {time: time - 0.004, position: at, approach_speed: speed, effective_mass: mass};
      const bell = [0.3 * time, 0, 0];
      post(list, {
        ...shared, body: 1, other: 2, impulse: [0, 1.6 * mass * speed, 0], normal: [0, 1, 0],
        radius: 0.01, other_radius: 1e9, body_position: [at[0], 0.03, at[2]],
        body_velocity: [0, -speed, 0], has_other_pose: 1, other_position: bell,
      });
      post(list, {
        ...shared, body: 2, other: 1, impulse: [0, -1.6 * mass * speed, 0], normal: [0, -1, 0],
        radius: 1e9, other_radius: 0.01, body_position: bell, body_velocity: [0.3, 0, 0],
        has_other_pose: 1, other_position: [at[0], 0.03, at[2]],
      });
    }
    list.numbers('place', 'f64', [0.3 * time, 0, 0]);
    list.call('carom_move_body', '@sound', 2, time, '@place', '@upright');
    advance(list, time, step > 1 ? kRate / 100 : 0);
  }
  return list;
}

/// Slopes of bumps of 0.3 mm on a texture of 256 x 256 texels of 0.1 mm.
function slopesOf(random) {
  const waves = Array.from({length: 40}, () => [
    1 + Math.floor(60 * random()), 1 + Math.floor(60 * random()), 2 * Math.PI * random(), random(),
  ]);
  const slopes = [];
  for (let v = 0; v < 256; ++v)
    for (let u = 0; u < 256; ++u) {
      let [alongU, alongV] = [0, 0];
      for (const [kU, kV, phase, size] of waves) {
        const slope = 0.01 * size * Math.cos(2 * Math.PI * (kU * u + kV * v) / 256 + phase);
        alongU += slope * kU / 60;
        alongV += slope * kV / 60;
      }
      slopes.push(Math.fround(alongU), Math.fround(alongV));
    }
  return slopes;
}

function slide(layout, files, settings = {}) {
  const list = begin(layout, [{position: [0.3, 0.4, 0.2]}], settings);
  list.numbers('texel', 'f64', [1e-4, 1e-4]);
  list.numbers('slopes', 'f32', slopesOf(randomNumbers(4)));
  list.call('carom_make_texture', 256, 256, '@texel', '@slopes', '>texture');
  const mass = addBall(list, 1, 0.02, {texture: '@texture'});
  for (let step = 1; step <= 120; ++step) {
    const duration = 1 / 240;
    const time = duration * (step - 1);
    const speed = 0.5 - 0.3 * time;
    const at = 0.4 * time - 0.1;
    const next = at + speed * duration;
    if (step <= 100) {
      list.struct('carom_contact', 'contact', {
        time, duration, body: 1, other: kFloor, normal: [0, 1, 0], position: [at, 0, 0],
        normal_load: step === 100 ? 0 : mass * kGravity, applied_impulse: [0, mass * kGravity * duration, 0],
        radius: 0.02, other_radius: 1e9, slip_velocity: [speed, 0, 0],
        rolling_velocity: [speed / 2, 0, 0], body_position: [at, 0.02, 0],
        body_velocity: [speed, 0, 0], path_start: [0, -0.02, 0], path_end: [0, -0.02, 0],
        other_path_start: [at, 0, 0], other_path_end: [next, 0, 0],
        phase: step === 1 ? 'CAROM_CONTACT_BEGIN'
                          : step === 100 ? 'CAROM_CONTACT_END' : 'CAROM_CONTACT_DURING',
      });
      list.call('carom_update_contact', '@sound', '@contact');
    }
    advance(list, duration * step, step > 3 ? 200 : 0);
  }
  return list;
}

/// A room of six walls, of the third order and with the reverberation that follows.
function room(layout) {
  const list = new CallList(layout);
  const walls = [[0, 1, 0, -1.2], [0, -1, 0, -1.6], [1, 0, 0, -2.5], [-1, 0, 0, -3], [0, 0, 1, -2.2],
                 [0, 0, -1, -2.8]];
  list.add('struct', 'carom_reflector', 'walls', walls.length);
  walls.forEach(([x, y, z, offset], index) => list.set(`walls:${index}`, {
    normal: [x, y, z], offset, absorption: [0.1, 0.12, 0.15, 0.2, 0.25, 0.3, 0.35],
  }));
  list.struct('carom_room', 'room', {reflectors: '@walls', reflector_count: walls.length, order: 3});
  list.struct('carom_reverb', 'reverb', {});
  list.call('carom_reverb_of_box', '@room', 343, '@reverb');
  const begun = begin(layout, [{position: [0.2, 0.3, 0.1]}], {room: '@room', reverb: '@reverb'});
  list.steps.push(...begun.steps);
  rain(list, 5);
  return list;
}

/// Ears that turn, in a head of measured responses.
function head(layout, files) {
  const bytes = readFileSync(files.head);
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.length);
  const [directions, length, rate] = [0, 8, 16].map((at) => view.getFloat64(at, true));
  const list = new CallList(layout);
  list.add('file', 'measured', files.head);
  const samplesAt = 24 + 8 * 5 * directions;
  list.struct('carom_head_responses', 'responses', {
    sample_rate: rate, directions: '@measured+24', delays: `@measured+${24 + 24 * directions}`,
    samples: `@measured+${samplesAt}`, direction_count: directions, length,
  });
  list.call('carom_make_head', '@responses', kRate, '>head');
  const begun = begin(layout, [{format: 'CAROM_LISTENER_BINAURAL', head: '@head'}]);
  list.steps.push(...begun.steps);
  list.numbers('here', 'f64', [0, 0, 0]);
  rain(list, 6, (step) => {
    list.numbers('turn', 'f64', [0, Math.sin(0.005 * step), 0, Math.cos(0.005 * step)]);
    list.call('carom_set_listener', '@sound', 0, '@here', '@turn');
  });
  return list;
}

function moving(layout) {
  const pair = {format: 'CAROM_LISTENER_SPACED_PAIR', spacing: 0.17, pattern: 0.3, half_angle: 1.5};
  const list = begin(layout, [pair], {air_absorption: 1});
  rain(list, 7, (step) => {
    const time = 0.01 * step;
    list.numbers('place', 'f64', [3 * time - 1.5, 0.2 * Math.sin(5 * time), 0.5]);
    list.numbers('turn', 'f64', [0, Math.sin(time), 0, Math.cos(time)]);
    list.call('carom_set_listener', '@sound', 0, '@place', '@turn');
  });
  return list;
}

/// 20,000 clicks of eight sizes in 10 s, for the time that they take.
export function manyClicks(layout) {
  const list = begin(layout, [{position: [0.2, 0.3, 0.1]}], {voices: 65536});
  const random = randomNumbers(8);
  const radii = Array.from({length: 8}, (_, index) => 0.004 * 1.3 ** index);
  const masses = radii.map((radius, index) => addBall(list, index + 1, radius));
  for (let step = 1; step <= 1000; ++step) {
    for (let click = 0; click < 20; ++click) {
      const kind = Math.floor(8 * random());
      const place = [4 * random() - 2, -1.2, 4 * random() - 2];
      const time = 0.01 * (step - random());
      post(list, landing(time, kind + 1, masses[kind], radii[kind], place, 0.2 + 2 * random()));
    }
    advance(list, 0.01 * step, step > 1 ? kRate / 100 : 0);
  }
  return list;
}

/// A block that rings in 64 modes, for 10 s.
export function longRing(layout, files) {
  const list = ring(layout, files);
  for (let step = 101; step <= 1000; ++step) advance(list, 0.01 * step, kRate / 100);
  return list;
}

export const kScenes = {
  clicks, box, ring,
  'ring, coupled': (layout, files) =>
      ring(layout, files, {ringing_contact: 'CAROM_RINGING_COUPLED'}),
  slide,
  'slide, exact': (layout, files) => slide(layout, files, {lasting: 'CAROM_LASTING_EXACT'}),
  'room with reverberation': room, head, 'moving pair': moving,
};
