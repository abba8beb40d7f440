// What was changed in a live run, and when, so that a rewind takes it back, too: added bodies and settings.

/// Settings at a time: {gravity, restitution, friction, stepper, step}; undefined where nobody has set them.
export class Journal {
  #changes = [];   // {time, body: JSON of a body, id} or {time, set: {...}}

  constructor(scene) {
    this.scene = scene;
  }
  get changes() {
    return this.#changes;
  }
  note(change) {
    this.#changes.push(change);
  }
  /// Takes back what came after a time (s).
  keep(time) {
    this.#changes = this.#changes.filter((change) => change.time <= time + 1e-9);
  }
  /// The time (s) of the latest change; null if there is none.
  get latest() {
    return this.#changes.at(-1)?.time ?? null;
  }

  get settings() {
    const {scene} = this;
    const begun = {gravity: scene.gravity ?? [0, -9.81, 0], stepper: scene.stepper?.type ?? 'native', step: scene.stepper?.step ?? 1 / 240};
    return Object.assign(begun, ...this.#changes.map((change) => change.set ?? {}));
  }
}
