// Draws over the pictures of a film: its title, the time, who has just met whom, and the level of the sound.
import {namesOf} from '../run/data.js';
import {quantity, speedWords} from '../text/dom.js';

const kTall = 720;               // pixels of a picture for which the sizes here are meant
const kFamily = 'system-ui, -apple-system, "Segoe UI", Roboto, "Helvetica Neue", "Liberation Sans", sans-serif';
const kDark = {ink: '#fff', soft: 'rgb(255 255 255 / .74)', accent: '#ffc163', hot: '#ff7d6e', plate: 'rgb(10 14 19 / .58)', empty: 'rgb(255 255 255 / .13)'};
const kLight = {ink: '#1a2128', soft: 'rgb(26 33 40 / .78)', accent: '#c97a16', hot: '#c8301f', plate: 'rgb(255 255 255 / .74)', empty: 'rgb(26 33 40 / .13)'};
const kTitleStays = 3, kTitleFades = 0.6;   // s of the film
const kEventStays = 0.9, kEventFades = 0.3;
const kQuieter = 36;             // dB below the loudest event: what is quieter has no words
const kRed = 3;               // dB below the top of the meter, from where on it is red

/// A pen that counts in pixels of a picture 720 high.
class Words {
  constructor(pen, scale, tints) {
    Object.assign(this, {pen, scale, tints});
  }
  font(size, weight = 400) {
    this.pen.font = `${weight} ${size * this.scale}px ${kFamily}`;
  }
  width(text) {
    return this.pen.measureText(text).width / this.scale;
  }
  text(text, x, y, colour, align = 'left') {
    Object.assign(this.pen, {fillStyle: colour, textAlign: align, textBaseline: 'alphabetic'});
    this.pen.fillText(text, x * this.scale, y * this.scale);
  }
  /// A rounded plate behind words, so that they are read on any ground.
  plate(x, y, width, height, colour = this.tints.plate, round = 9) {
    this.pen.fillStyle = colour;
    this.pen.beginPath();
    this.pen.roundRect(x * this.scale, y * this.scale, width * this.scale, height * this.scale, round * this.scale);
    this.pen.fill();
  }
}

/// 1 until `stays`, then falling to 0 within `fades`.
function fade(age, stays, fades) {
  return Math.max(0, Math.min(1, (stays - age) / fades));
}

/// The loudest event of the last moment, and for how long (s of the film) it has been: null if there is none.
function latestEvent(run, time, speed) {
  const loudest = run.events.reduce((most, event) => Math.max(most, event.level), -Infinity);
  let chosen = null;
  for (const event of run.events) {
    const age = (time - event.time) / speed;
    if (age < 0 || age > kEventStays || event.level < loudest - kQuieter) continue;
    if (!chosen || event.level > chosen.event.level) chosen = {event, age};
  }
  return chosen;
}

function drawTitle(words, {title, watch}) {
  words.pen.globalAlpha = fade(watch, kTitleStays, kTitleFades);
  if (words.pen.globalAlpha === 0) return;
  words.font(24, 600);
  words.plate(28, 26, words.width(title) + 32, 46);
  words.text(title, 44, 57.5, words.tints.ink);
}

function drawClock(words, {run, time, speed, width}) {
  words.pen.globalAlpha = 1;
  words.font(20, 600);
  const digits = speed < 0.02 ? 6 : speed < 0.2 ? 4 : 2;
  const clock = `${Math.min(time, run.duration).toFixed(digits)} s`, slow = Math.abs(speed - 1) > 0.005 ? (speed > 1 ? `${Number(speed.toPrecision(2))}` : speedWords(speed)) : '';
  const plate = words.width(`${(88.8).toFixed(digits)} s`) + 32, aside = slow ? words.width(` × ${slow}`) + 8 : 0;
  words.plate(width - 28 - plate - aside, 26, plate + aside, 42);
  words.text(clock, width - 44 - aside, 54, words.tints.ink, 'right');
  if (slow) words.text(`× ${slow}`, width - 44, 54, words.tints.accent, 'right');
}

function drawEvent(words, {run, time, speed, height}) {
  const latest = latestEvent(run, time, speed);
  if (!latest) return;
  const {event, age} = latest, [one, two] = namesOf(run, event);
  const spell = (name) => name.replaceAll('_', ' ');
  const who = two ? `${spell(one)} and ${spell(two)}` : spell(one);
  const how = `${quantity(event.approachSpeed, 'm/s')} · ${quantity(event.impulse, 'N s')}`;
  words.pen.globalAlpha = fade(age, kEventStays, kEventFades);
  words.font(21, 600);
  const whoWide = words.width(who);
  words.font(19);
  const wide = whoWide + 16 + words.width(how);
  words.plate(28, height - 74, wide + 32, 46);
  words.text(how, 44 + whoWide + 16, height - 44, words.tints.soft);
  words.font(21, 600);
  words.text(who, 44, height - 44, words.tints.ink);
}

/// A bar for each channel, from `top` - `range` to `top` dB of sound pressure level; a line at the peak of late.
function drawMeter(words, {meter, levels, width, height}) {
  const {top, range} = meter, low = height - 60, high = 0.36 * height, bar = 11, gap = 5;
  const all = levels.length * (bar + gap) - gap, left = width - 28 - 14 - all;
  const at = (level) => low - (low - high) * Math.max(0, Math.min(1, 1 + (level - top) / range));
  words.pen.globalAlpha = 1;
  words.plate(left - 48, high - 18, all + 62, low - high + 44);
  words.font(13);
  for (let level = 20 * Math.ceil((top - range) / 20); level <= top; level += 20) {
    words.text(String(level), left - 9, at(level) + 4.5, words.tints.soft, 'right');
    words.plate(left - 5, at(level) - 0.5, 3, 1, words.tints.soft, 0);
  }
  words.text('dB', left + all / 2, low + 17, words.tints.soft, 'center');
  levels.forEach(({now, peak}, channel) => {
    const x = left + channel * (bar + gap);
    words.plate(x, high, bar, low - high, words.tints.empty, 3);
    if (at(now) < low) words.plate(x, at(now), bar, low - at(now), now > top - kRed ? words.tints.hot : words.tints.accent, 3);
    if (at(peak) < low) words.plate(x, at(peak) - 1, bar, 2, peak > top - kRed ? words.tints.hot : words.tints.ink, 0);
  });
}

export function drawOverlay(pen, shown) {
  const scale = pen.canvas.height / kTall, words = new Words(pen, scale, shown.dark ? kDark : kLight);
  const all = {...shown, width: pen.canvas.width / scale, height: kTall};
  pen.save();
  if (shown.captions) {
    drawTitle(words, all);
    drawClock(words, all);
    drawEvent(words, all);
  }
  if (shown.meter && shown.levels.length) drawMeter(words, all);
  pen.restore();
}
