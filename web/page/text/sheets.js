// The sheets of help and of notices.
import {byId, make, setIcon} from './dom.js';
import {kNotices} from './notices.js';

const kKeys = [
  ['Time', [
    ['Space', 'play, pause'], ['← →', 'back, on; with shift ten times as far'], ['[ ]', 'previous, next event'],
    ['Home End', 'to the beginning, to the end'], ['− +', 'slower, faster'], ['L', 'loop what the time line shows, or end the loop'],
    ['I O', 'loop begins, ends here'], ['↑ ↓', 'zoom the time line in, out'],
  ]],
  ['Sound', [
    ['M', 'mute'], ['H', 'ear: with the camera, stays, the run’s listeners'], ['T', 'mono, pair, head'], ['B', 'sheet of sound and bodies'],
    ['C', 'the selected event’s sound alone'], ['1 to 9', 'switch between runs'], ['V', 'next run'],
  ]],
  ['Live', [
    ['G', 'play with it; go on from here'], ['R', 'throw where the pointer is'], ['X', 'drop where the pointer is'], ['K', 'push the selected body'],
    ['J', 'next tool: hand, throw, drop'], ['P', 'sheet of bodies to throw, and of the world'], ['Z', 'take back the latest change'],
  ]],
  ['View', [
    ['W A S D', 'fly ahead, left, back, right'], ['Q E', 'fly down, up'], ['Shift W A S D', 'orbit'], ['0', 'show all'],
    ['N', 'select the next body'], ['F', 'film: play what the time line shows once, and save it'], ['Esc', 'close'], ['?', 'this sheet'],
  ]],
  ['Mouse and touch', [
    ['Drag, one finger', 'orbit'], ['Right drag, two fingers', 'move'], ['Wheel, pinch', 'nearer, further'], ['Click, tap', 'select a body, or a mark'],
    ['Drag a body', 'pull it, in a live run'],
    ['On the time line', 'drag to scrub, shift and drag to loop, wheel or pinch to zoom, alt and drag to move, double click for all'],
  ]],
];

function fill(dialog, title, id, ...content) {
  const close = make('button', {type: 'button', class: 'close', 'aria-label': 'Close', onclick: () => dialog.close()});
  setIcon(close, 'close');
  dialog.replaceChildren(make('div', {class: 'top'}, make('h2', {id}, title), close), ...content);
  dialog.addEventListener('click', (event) => event.target === dialog && dialog.close());
}

export function fillSheets(version) {
  fill(byId('help'), 'Keys and gestures', 'help-title', make('div', {class: 'columns'}, ...kKeys.map(([name, keys]) =>
      make('section', {}, make('h3', {}, name), make('dl', {class: 'keys'},
          ...keys.flatMap(([key, words]) => [make('dt', {}, ...key.split(' ').map((part) => /^(to|and|finger|fingers|one|two|drag|On|the|time|line|Click,|a|body|tap|Wheel,|pinch|Drag,|Right|drag,)$/.test(part)
              ? ` ${part} ` : make('kbd', {}, part))), make('dd', {}, words)]))))));
  fill(byId('about'), 'About this page', 'about-title',
       make('p', {}, `The picture and the sound are made in this page, by Carom${version ? ` ${version}` : ''}: the sound of every contact is computed from what the simulation recorded, while you listen. `
                     + 'Nothing is loaded from anywhere. Samples are sound pressures at the ear; what you hear is limited softly where it would be too loud for the device.'),
       make('h3', {}, 'Notices'),
       ...kNotices.map(({name, licence, text}) => make('details', {}, make('summary', {}, name, make('span', {class: 'quiet'}, ` ${licence}`)), make('pre', {}, text))));
}

/// One sheet at a time; focus returns to where it was when it closes.
export function toggleSheet(id) {
  const dialog = byId(id);
  if (dialog.open) dialog.close(); else dialog.showModal();
}
