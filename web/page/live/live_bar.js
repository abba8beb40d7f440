// The strip above the time line while a live run is shown: tools, the chosen body, the way back to the present, and
// what the engine has refused.
import {byId, make, quantity, setIcon} from '../text/dom.js';

const kTools = [['hand', 'Hand', 'Pull bodies; a press beside them does nothing (J: next tool)'],
                ['throw', 'Throw', 'A press throws the chosen body from here (R)'], ['drop', 'Drop', 'A press drops the chosen body there (X)']];
const kSaid = 7000;   // ms that a sentence stays

/// 12 mm, 4 cm, 0.3 m
export function sizeWords(size) {
  if (size < 0.01) return quantity(size, 'm', 2);
  return size < 0.3 ? `${Number((100 * size).toPrecision(2))}\u202fcm` : quantity(size, 'm', 2);
}

export class LiveBar {
  #timer = 0;

  constructor(desk) {
    this.desk = desk;
    this.element = byId('live-bar');
    this.tools = kTools.map(([tool, words, title]) => {
      const button = make('button', {type: 'button', role: 'radio', title, 'aria-label': words, onclick: () => desk.setTool(tool)}, make('span', {}, words));
      setIcon(button, tool);
      return button;
    });
    byId('live-tools').append(...this.tools);
    byId('live-tools').addEventListener('keydown', (event) => this.#arrow(event));
    byId('open-live').onclick = () => desk.sheet.toggle();
    byId('go-on').onclick = () => desk.try(() => desk.live.goOn());
  }
  #arrow(event) {
    const way = {ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1}[event.key];
    if (!way) return;
    event.preventDefault();
    const next = (this.tools.indexOf(document.activeElement) + way + this.tools.length) % this.tools.length;
    this.desk.setTool(kTools[next][0]);
    this.tools[next].focus();
  }

  show() {
    const {desk} = this, {live, choice} = desk;
    this.element.hidden = !live.running;
    document.body.classList.toggle('live', live.running);
    byId('play-with-it').hidden = !desk.offers || live.running;
    if (!live.running) return;
    kTools.forEach(([tool], index) => {
      this.tools[index].setAttribute('aria-checked', String(tool === desk.tool));
      this.tools[index].tabIndex = tool === desk.tool ? 0 : -1;
    });
    const words = `${sizeWords(choice.size)} ${choice.material.replaceAll('_', ' ')}${choice.shape === 'box' ? ' box' : ''}`;
    byId('live-choice').textContent = words;
    byId('open-live').setAttribute('aria-label', `Live: what is thrown, and the world. Now: ${words}`);
    byId('go-on').hidden = !live.past;
    byId('live-slow').hidden = !live.slow;
  }

  /// A sentence that stays for a while.
  say(words) {
    const line = byId('live-words');
    clearTimeout(this.#timer);
    line.textContent = words;
    line.hidden = false;
    this.#timer = setTimeout(() => line.hidden = true, kSaid);
  }
}
