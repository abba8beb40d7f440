// The stretch of time that the bar shows, and what drags and wheels do to it.

const kShortest = 2e-5;   // s

/// Emits `change`.
export class Window extends EventTarget {
  constructor(duration) {
    super();
    this.duration = duration;
    this.begin = 0;
    this.end = duration;
  }
  get span() {
    return this.end - this.begin;
  }
  get zoomed() {
    return this.span < 0.999 * this.duration;
  }
  set(begin, end) {
    const span = Math.min(this.duration, Math.max(kShortest, end - begin));
    this.begin = Math.min(this.duration - span, Math.max(0, begin));
    this.end = this.begin + span;
    this.dispatchEvent(new Event('change'));
  }
  /// Zooms by `factor` so that `time` stays where it is.
  zoom(factor, time) {
    const span = Math.min(this.duration, Math.max(kShortest, this.span * factor));
    const part = (time - this.begin) / this.span;
    this.set(time - part * span, time + (1 - part) * span);
  }
  move(seconds) {
    this.set(this.begin + seconds, this.end + seconds);
  }
  /// Follows the time that plays.
  show(time) {
    if (time >= this.begin && time <= this.end) return;
    this.set(time - 0.1 * this.span, time + 0.9 * this.span);
  }
}
