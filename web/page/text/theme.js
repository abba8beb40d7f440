// Colours of the picture and the time line, dark and light; page.css has those of the rest.
import {rgbOfLch} from '../stage/colours.js';

/// 256 colours [r, g, b, a] from silence to the loudest, through stops of OKLCH.
function ramp(stops) {
  return Array.from({length: 256}, (none, step) => {
    const place = step / 255 * (stops.length - 1), index = Math.min(stops.length - 2, Math.floor(place)), part = place - index;
    const lch = stops[index].map((from, item) => from + part * (stops[index + 1][item] - from));
    return [...rgbOfLch(lch), Math.round(255 * Math.min(1, step / 40))];
  });
}

const kDark = {
  dark: true, backdrop: ['#0d1117', '#141b24', '#1d2732', '#1a222c'], ground: '#2c3a48', grid: '#8fa6bb', shadow: 0.5,
  link: '#aab4bf', room: '#7f93a8', listener: '#d5d9de', accent: '#ffc163', glow: '#ffe0a8', ambient: 2.2, sun: 2.5, sky: '#d6e2f0', bounce: '#858b94', lamp: 1,
  soft: '#9aa7b4', line: 'rgb(140 160 180 / .16)', paper: '#12171d',
  ramp: ramp([[0.2, 0.03, 260], [0.36, 0.11, 280], [0.52, 0.17, 330], [0.68, 0.17, 385], [0.83, 0.14, 435], [0.97, 0.06, 460]]),
};
const kLight = {
  dark: false, backdrop: ['#e9eef2', '#f1f3f3', '#f6f4ef', '#ece8e0'], ground: '#fffdf8', grid: '#6d7c8a', shadow: 0.26,
  link: '#69737d', room: '#7b8a98', listener: '#4a545e', accent: '#9a4f00', glow: '#ff8a1f', ambient: 2, sun: 2.1, sky: '#ffffff', bounce: '#b5ada0', lamp: 0.9,
  soft: '#55606b', line: 'rgb(60 80 100 / .16)', paper: '#fcfbf8',
  ramp: ramp([[0.96, 0.02, 240], [0.84, 0.08, 230], [0.68, 0.13, 250], [0.52, 0.18, 285], [0.4, 0.17, 320], [0.28, 0.11, 350]]),
};

/// Calls `paint` with the theme now and whenever the reader's preference changes.
export function followTheme(paint) {
  const light = matchMedia('(prefers-color-scheme: light)');
  const tell = () => paint(light.matches ? kLight : kDark);
  light.addEventListener('change', tell);
  tell();
}
