// Everything by keyboard alone. Letters that fly work while they are held.

const kFly = {KeyW: [0, 0, 1], KeyS: [0, 0, -1], KeyA: [-1, 0, 0], KeyD: [1, 0, 0], KeyE: [0, 1, 0], KeyQ: [0, -1, 0]};
const kRepeats = /^(Arrow.*|[-+=[\]])$/;   // keys that act again while they are held
const kFlySpeed = 0.9;      // radii of the scene in a second
const kOrbitSpeed = 1.4;    // rad in a second

function writes(target) {
  return target.matches?.('input[type=search], textarea, select');
}
/// Buttons take the space bar, sliders take arrows.
function keepsKey(target, key) {
  if (target.matches?.('input[type=range]')) return /^(Arrow|Home|End|Page)/.test(key);
  if (target.matches?.('[role=radio]')) return /^Arrow| |Enter/.test(key);
  return target.matches?.('button, summary, a') && (key === 'Enter' || key === ' ');
}

/// `acts` is a table of functions by key (main.js).
export class Keys {
  #held = new Set();

  constructor(acts) {
    this.acts = acts;
    addEventListener('keydown', (event) => this.#down(event));
    addEventListener('keyup', (event) => this.#held.delete(event.code));
    addEventListener('blur', () => this.#held.clear());
  }
  #down(event) {
    if (event.ctrlKey || event.metaKey || event.altKey || writes(event.target) || keepsKey(event.target, event.key)) return;
    const open = document.querySelector('dialog[open]');
    if (open && event.key !== '?') return;
    if (kFly[event.code] && event.key.toLowerCase() === event.code.slice(3).toLowerCase()) {
      this.#held.add(event.code);
      this.shift = event.shiftKey;
      return;
    }
    const act = this.acts[event.key] ?? this.acts[event.key.toLowerCase()];
    if (!act) return;
    event.preventDefault();
    if (!event.repeat || kRepeats.test(event.key)) act(event);
  }

  /// Moves the view by the keys that are held, for one picture of `seconds`; true if any are.
  fly(stage, seconds) {
    if (!this.#held.size) return false;
    const way = [0, 0, 0];
    for (const code of this.#held) kFly[code].forEach((step, axis) => way[axis] += step);
    const step = Math.min(0.1, seconds);
    if (this.shift) stage.orbit(kOrbitSpeed * step * way[0], kOrbitSpeed * step * (way[2] + way[1]));
    else stage.fly(...way.map((part) => kFlySpeed * step * part));
    return true;
  }
}
