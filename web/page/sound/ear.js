// Where is heard, and what: the ear's place and format, kinds of sound, solo and mute of bodies.

export const kKinds = [{name: 'Clicks', bit: 1}, {name: 'Rings', bit: 2}, {name: 'Slides', bit: 4}];

/// Emits `change` when what is heard changes, so that the sound begins anew where it is.
export class Ear extends EventTarget {
  mode = 'camera';       // 'camera': goes with the view; 'stay'; 'listener'
  listener = 0;
  format = 'mono';
  pose = [0, 0, 0, 1, 0, 0, 0];   // x y z, w x y z: right +x, up +y, forward -z
  kinds = 7;
  muted = new Set();
  solo = new Set();

  #changed() {
    this.dispatchEvent(new Event('change'));
  }
  setMode(mode, listener = this.listener) {
    this.mode = mode;
    this.listener = listener;
    this.#changed();
  }
  setFormat(format) {
    this.format = format;
    this.#changed();
  }
  toggleKind(bit) {
    this.kinds ^= bit;
    this.#changed();
  }
  toggle(set, body) {
    if (!set.delete(body)) set.add(body);
    this.#changed();
  }
  clear() {
    this.muted.clear();
    this.solo.clear();
    this.#changed();
  }

  isAudible(body) {
    return !this.muted.has(body) && (this.solo.size === 0 || this.solo.has(body));
  }
  /// True if a mark of the time line is heard: a collision sounds by both of its bodies.
  hears(event) {
    return this.isAudible(event.body) || (event.other >= 0 && this.isAudible(event.other));
  }
  silentBodies(run) {
    if (!this.muted.size && !this.solo.size) return null;
    return new Set(run.bodies.map((body) => body.id).filter((id) => !this.isAudible(id)));
  }

  /// What the engine is told (engine.js, hear).
  order(run, only = -1) {
    const follow = this.mode === 'listener' && run.listeners[this.listener] ? this.listener : -1;
    return {format: this.format, follow, pose: this.pose, kinds: only >= 0 ? 7 : this.kinds, only,
            silent: only >= 0 ? null : this.silentBodies(run)};
  }
}
