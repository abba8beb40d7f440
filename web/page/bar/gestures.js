// Pointer and wheel on the time line: scrub, choose marks, make loops, zoom, move; two fingers zoom.

const kStill = 5;   // pixels that a click may move

/// `on` has scrub(time, done), choose(event), loop([begin, end]), hover(event, x).
export class Gestures {
  #pointers = new Map();
  #drag = null;

  constructor(element, timeline, window, on) {
    Object.assign(this, {element, timeline, window, on});
    element.addEventListener('pointerdown', (event) => this.#down(event));
    element.addEventListener('pointermove', (event) => this.#move(event));
    for (const name of ['pointerup', 'pointercancel']) element.addEventListener(name, (event) => this.#up(event));
    element.addEventListener('pointerleave', () => this.on.hover(null, 0));
    element.addEventListener('wheel', (event) => this.#wheel(event), {passive: false});
    element.addEventListener('dblclick', () => this.window.set(0, this.window.duration));
  }
  #at(event) {
    const box = this.element.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  }
  #down(event) {
    if (event.button > 1) return;
    const [x, y] = this.#at(event);
    this.element.setPointerCapture(event.pointerId);
    this.#pointers.set(event.pointerId, x);
    if (this.#pointers.size === 2) return this.#pinch();
    const kind = event.button === 1 || event.altKey ? 'move' : event.shiftKey ? 'loop' : 'scrub';
    this.#drag = {kind, from: x, y, time: this.timeline.time(x), still: true};
  }
  #pinch() {
    const [one, two] = this.#pointers.values();
    this.#drag = {kind: 'pinch', times: [this.timeline.time(one), this.timeline.time(two)]};
  }
  #move(event) {
    const [x, y] = this.#at(event);
    if (!this.#drag) return this.on.hover(this.timeline.at(x, y), x);
    if (this.#pointers.has(event.pointerId)) this.#pointers.set(event.pointerId, x);
    const drag = this.#drag;
    if (drag.kind === 'pinch') return this.#stretch(drag);
    if (drag.still && Math.abs(x - drag.from) < kStill) return undefined;
    drag.still = false;
    this.on.hover(null, 0);
    if (drag.kind === 'move') return this.window.move(drag.time - this.timeline.time(x));
    if (drag.kind === 'loop') return this.on.loop([drag.time, this.timeline.time(x)].sort((a, b) => a - b));
    return this.on.scrub(this.timeline.time(x), false);
  }
  /// Keeps the times under both fingers.
  #stretch({times}) {
    const [one, two] = this.#pointers.values();
    if (this.#pointers.size !== 2 || Math.abs(two - one) < 8) return;
    const scale = (times[1] - times[0]) / (two - one);
    if (scale > 0) this.window.set(times[0] - one * scale, times[0] + (this.timeline.width - one) * scale);
  }
  #up(event) {
    this.#pointers.delete(event.pointerId);
    const drag = this.#drag;
    if (!drag || this.#pointers.size) return;
    this.#drag = null;
    if (drag.kind === 'scrub') this.#endScrub(drag, event);
  }
  #endScrub(drag, event) {
    const [x] = this.#at(event);
    if (!drag.still) return this.on.scrub(this.timeline.time(x), true);
    const mark = this.timeline.at(x, drag.y);
    return mark ? this.on.choose(mark) : this.on.scrub(this.timeline.time(x), true);
  }
  #wheel(event) {
    event.preventDefault();
    const [x] = this.#at(event);
    const unit = event.deltaMode === 1 ? 16 : 1;
    if (event.shiftKey || Math.abs(event.deltaX) > Math.abs(event.deltaY)) {
      return this.window.move((event.deltaX || event.deltaY) * unit / this.timeline.width * this.window.span);
    }
    return this.window.zoom(Math.exp(event.deltaY * unit * 0.002), this.timeline.time(x));
  }
}
