// What each key does (keys.js finds it, sheets.js explains it).
import {toggleSheet} from './sheets.js';

const kFaster = 10 ** 0.25;
const kZoom = 0.8;

export function keysOf(view) {
  const {player, bar, ear, live} = view;
  const acts = {
    ' ': () => player.toggle(),
    'ArrowLeft': ({shiftKey}) => view.move(shiftKey ? -10 : -1),
    'ArrowRight': ({shiftKey}) => view.move(shiftKey ? 10 : 1),
    'ArrowUp': () => bar.window.zoom(kZoom, player.time),
    'ArrowDown': () => bar.window.zoom(1 / kZoom, player.time),
    '[': () => view.step(-1),
    ']': () => view.step(1),
    'Home': () => player.seek(0),
    'End': () => player.seek(player.duration),
    '-': () => bar.faster(1 / kFaster),
    '+': () => bar.faster(kFaster),
    '=': () => bar.faster(kFaster),
    'l': () => bar.toggleLoop(),
    'i': () => view.loopFrom(true, player.time),
    'o': () => view.loopFrom(false, player.time),
    'm': () => view.mute(),
    'h': () => view.nextEar(),
    't': () => ear.mode !== 'listener' && view.nextFormat(),
    'b': () => view.mixer.toggle(),
    'c': () => view.selected && !view.sound.reason && player.alone(view.selected),
    'v': () => view.nextRun(1),
    'g': () => live.play(),
    'r': () => live.throwAt(),
    'x': () => live.dropAt(),
    'k': () => live.push(),
    'j': () => live.nextTool(),
    'p': () => live.live.running && live.sheet.toggle(),
    'z': () => live.live.running && live.try(() => live.live.takeBack()),
    'f': () => view.recorder.toggle(),
    'n': ({shiftKey}) => view.nextBody(shiftKey ? -1 : 1),
    '0': () => view.showAll(),
    'Escape': () => !live.sheet.element.hidden ? live.sheet.toggle(false) : view.mixer.element.hidden ? view.close() : view.mixer.toggle(false),
    '?': () => toggleSheet('help'),
  };
  for (let number = 1; number <= 9; ++number) acts[number] = () => player.setRun(number - 1);
  return acts;
}
