// Pointer on the picture while a live run is shown: bodies are pulled, and a press beside them throws or drops.
import {facing} from './aim.js';

const kStill = 5;      // pixels that a press may move and be no drag
const kHover = 60;     // ms between two looks at what the pointer is over

/// `act` has press(x, y): a press that is no drag, true if it did something; pullable(body), pull, release, select(body).
export class Gestures {
  x = null;            // the pointer's latest place; null while it is not on the picture
  y = null;
  #drag = null;
  #press = null;
  #looked = 0;

  constructor(stage, live, act) {
    Object.assign(this, {stage, live, act});
    // The picture's own gestures come after these, and only where these leave a press to them.
    const main = stage.canvas.parentElement, early = {capture: true};
    main.addEventListener('pointerdown', (event) => this.#down(event), early);
    addEventListener('pointermove', (event) => this.#move(event), early);
    for (const name of ['pointerup', 'pointercancel']) addEventListener(name, (event) => this.#up(event), early);
  }

  #down(event) {
    const {stage, live} = this;
    if (event.target !== stage.canvas || event.button !== 0 || !event.isPrimary || !live.running) return;
    [this.x, this.y] = [event.clientX, event.clientY];
    const hit = stage.pickPoint(event.clientX, event.clientY);
    this.#press = {from: [event.clientX, event.clientY], id: event.pointerId};
    if (!hit || !this.act.pullable(hit.body)) return;
    event.stopPropagation();
    event.preventDefault();
    stage.canvas.focus({preventScroll: true});
    stage.canvas.setPointerCapture(event.pointerId);
    this.#drag = {id: event.pointerId, body: hit.body, grip: hit.point.clone(), moved: false};
  }
  #move(event) {
    const {stage} = this, isOver = event.target === stage.canvas;
    if (event.isPrimary) [this.x, this.y] = isOver ? [event.clientX, event.clientY] : [null, null];
    if (this.#drag?.id !== event.pointerId) return this.#hover(event, isOver);
    event.stopPropagation();
    if (!this.#drag.moved && this.#isStill(event)) return undefined;
    this.#drag.moved = true;
    return this.#pull(event);
  }
  #isStill(event) {
    const {from} = this.#press;
    return Math.hypot(event.clientX - from[0], event.clientY - from[1]) <= kStill;
  }
  /// The body's middle follows, so that what is held stays under the pointer.
  #pull(event) {
    const {stage} = this, {body, grip} = this.#drag;
    const to = facing(stage, stage.ray(event.clientX, event.clientY), grip);
    const soft = body === stage.run.jello?.body;
    this.#drag.offset ??= soft ? [0, 0, 0] : grip.toArray().map((part, axis) => part - this.act.middle(body)[axis]);
    this.act.pull(body, to.toArray().map((part, axis) => part - this.#drag.offset[axis]), grip.toArray(), to.toArray());
  }
  #up(event) {
    const press = this.#press;
    if (press?.id !== event.pointerId) return;
    const drag = this.#drag, still = this.#isStill(event) && event.type === 'pointerup';
    this.#press = this.#drag = null;
    if (drag) {
      event.stopPropagation();
      if (drag.moved) return this.act.release();
    }
    if (!still || !this.live.running) return undefined;
    // The picture's own gestures have to learn that the press is over, but it is not one of theirs.
    if (this.act.press(event.clientX, event.clientY)) event.preventDefault();
    else if (drag) this.act.select(drag.body);
    return undefined;
  }
  /// What can be pulled is pointed at otherwise.
  #hover(event, isOver) {
    const {canvas} = this.stage;
    if (!this.live.running || event.buttons || event.pointerType === 'touch' || event.timeStamp - this.#looked < kHover) return;
    this.#looked = event.timeStamp;
    const body = isOver ? this.stage.pick(event.clientX, event.clientY) : null;
    canvas.style.cursor = body !== null && this.act.pullable(body) ? 'pointer' : '';
  }
}
