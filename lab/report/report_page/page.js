// The page of `carom report`: plots, tables and players from the two JSON elements beside this script.
// Nothing is fetched. Text from the data goes into text nodes only, never into markup.
(() => {
'use strict';

const failures = [];  // for the self test: whatever went wrong while the page ran
window.addEventListener('error', (event) => failures.push(event.message || 'error'));
window.addEventListener('unhandledrejection', (event) => failures.push(String(event.reason)));

// ---- Elements ----

/** An element with attributes (a function is a listener, true an attribute without a value) and children. */
function make(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (typeof value === 'function') element.addEventListener(name, value);
    else if (value !== false && value !== null && value !== undefined) element.setAttribute(name, value === true ? '' : value);
  }
  element.append(...children.flat().filter((child) => child !== null && child !== undefined));
  return element;
}

/** What is shown on demand, behind one line. */
const folded = (summary, content) => make('details', {class: 'folded'}, make('summary', {}, summary), content);

// ---- Numbers as text ----

const THIN = '\u202f';
const PREFIXES = [[-15, 'f'], [-12, 'p'], [-9, 'n'], [-6, 'µ'], [-3, 'm'], [0, ''], [3, 'k'], [6, 'M'], [9, 'G'], [12, 'T']];
const minus = (text) => text.replace(/-/g, '\u2212');
const superscript = (number) => String(number).replace(/./g, (c) => (c === '-' ? '⁻' : '⁰¹²³⁴⁵⁶⁷⁸⁹'[c]));

/** Three significant digits, as a power of ten where plain digits would be long. */
function digits(value, count = 3) {
  if (value === 0) return '0';
  const rounded = Number(value.toPrecision(count));
  const size = Math.abs(rounded);
  if (size >= 1e-3 && size < 10 ** count) return minus(rounded.toPrecision(count));
  if (size >= 10 ** count && size < 1e5) return minus(String(rounded));
  const [mantissa, exponent] = rounded.toExponential(count - 1).split('e');
  return minus(mantissa) + '·10' + superscript(Number(exponent));
}

/** With an SI prefix no smaller and no larger than those given as powers of ten. */
function withUnit(value, unit, least = -15, most = 12) {
  if (value === 0) return '0' + THIN + unit;
  const rounded = Number(value.toPrecision(3));
  const power = Math.min(Math.max(3 * Math.floor(Math.log10(Math.abs(rounded)) / 3 + 1e-9), least), most);
  const prefix = PREFIXES.find(([exponent]) => exponent === power)[1];
  return digits(rounded / 10 ** power) + THIN + prefix + unit;
}

const seconds = (value) => withUnit(value, 's', -15, 0);
const metres = (value) => withUnit(value, 'm', -15, 0);
const bytes = (value) => withUnit(value, 'B', 0);
const count = (value) => String(value);
const levelDifference = (value) => digits(value) + THIN + 'dB';
const simple = (value) => minus(String(Number(value.toPrecision(6))));
const spaced = (text) => String(text).replace(/_/g, ' ');

/** A ratio in percent; as a bare power of ten where percent would be all zeros. */
function ratio(value) {
  const size = Math.abs(value);
  return size === 0 || (size >= 9.995e-6 && size < 999) ? digits(value * 100) + THIN + '%' : digits(value);
}

function decibels(value) {
  return value > 0 ? ', ' + minus((20 * Math.log10(value)).toFixed(1)) + THIN + 'dB' : '';
}

function speed(total) {
  if (!(total > 0)) return '';
  return total <= 1 ? `${digits(1 / total)} times faster than real time` : `${digits(total)} times slower than real time`;
}

const numbered = (number, noun) => `${number} ${noun}${number === 1 ? '' : 's'}`;
const shown = (value, text) => (value === null || value === undefined ? '–' : text(value));

// ---- What is read ----

class Damage extends Error {}

const NOT_NEGATIVE = ['run_time.total', 'run_time.mechanics', 'run_time.sound', 'run_time.spread', 'run_time.runs', 'memory', 'events.reference',
  'events.matched', 'events.missed', 'events.spurious', 'event_time_error.rms', 'event_time_error.max', 'impulse_error.rms',
  'impulse_error.max', 'local_waveform_error', 'diverged_at', 'compared_until', 'waveform_error', 'aligned_waveform_error',
  'band_error_db', 'position_error'];

/** What stands at a path such as `run_time.total`; null for whatever is not there. */
function at(object, path) {
  let value = object;
  for (const key of path.split('.')) value = value === null || value === undefined ? null : value[key];
  return value === undefined ? null : value;
}

function requireNumber(value, where, least) {
  if (value === null) return;
  if (typeof value !== 'number' || !Number.isFinite(value)) throw new Damage(`${where} is not a number`);
  if (value < least) throw new Damage(`${where} is negative`);
}

function requireList(value, where) {
  if (!Array.isArray(value)) throw new Damage(`${where} is not a list`);
  return value;
}

function checkVariant(variant, where) {
  if (typeof variant.label !== 'string' || typeof variant.group !== 'string') throw new Damage(`${where} has no label or no group`);
  for (const path of NOT_NEGATIVE) requireNumber(at(variant, path), `${where}: ${path}`, 0);
  for (const path of ['energy_drift', 'delay']) requireNumber(at(variant, path), `${where}: ${path}`, -Infinity);
  for (const band of requireList(variant.bands || [], `${where}: bands`)) {
    if (!(band.frequency > 0)) throw new Damage(`${where}: a band has no frequency`);
    requireNumber(at(band, 'difference_db'), `${where}: a band`, -Infinity);
  }
}

function checkScene(scene) {
  if (!scene || typeof scene.name !== 'string') throw new Damage('a scene has no name');
  const ids = new Set();
  for (const variant of requireList(scene.variants, `${scene.name}: variants`)) {
    if (!variant || typeof variant.id !== 'string' || ids.has(variant.id)) throw new Damage(`${scene.name}: a variant has no id of its own`);
    ids.add(variant.id);
    checkVariant(variant, `${scene.name}, ${variant.id}`);
  }
  if (!ids.has(scene.reference)) throw new Damage(`${scene.name}: its reference is not among its variants`);
}

function parse(id) {
  const element = document.getElementById(id);
  if (!element) throw new Damage(`${id} is missing`);
  try {
    return JSON.parse(element.textContent);
  } catch (error) {
    throw new Damage(`${id} is not JSON`);
  }
}

function read() {
  if (typeof Chart === 'undefined') throw new Damage('the chart library is missing');
  const report = parse('carom-report');
  if (!report || report.format !== 'carom report 1') throw new Damage('its format is not “carom report 1”, which is all that this page reads');
  const names = requireList(report.scenes, 'scenes').map((scene) => (checkScene(scene), scene.name));
  if (new Set(names).size !== names.length) throw new Damage('two scenes have the same name');
  const media = parse('carom-media');
  if (!media || typeof media !== 'object') throw new Damage('carom-media is not an object');
  return {report, media};
}

// ---- Errors and the Pareto front ----

// `relative`: taken against the reference's own sound, so that the reference has none by definition.
const MEASURES = [
  {key: 'waveform_error', name: 'Waveform error', text: (v) => ratio(v) + decibels(v), tick: ratio, relative: true,
    note: 'RMS of the difference from the reference’s sound, over the RMS of the reference’s sound, up to where the motions part.'},
  {key: 'aligned_waveform_error', name: 'Waveform error, aligned', text: (v) => ratio(v) + decibels(v), tick: ratio, relative: true,
    note: 'The same after the whole sound is moved in time, by up to 5 ms, to where the two agree best: a delay alone is no error here.'},
  {key: 'local_waveform_error', name: 'Waveform error on the same path', text: (v) => ratio(v) + decibels(v), tick: ratio,
    note: 'The sound of the variant’s own collisions against that of the exact collisions on the same path: RMS of the difference over RMS of the exact.'},
  {key: 'event_time_error.rms', name: 'Error of collision times (RMS)', text: seconds, tick: seconds,
    note: 'RMS over the matched collisions, each against the exact time on the variant’s own path.'},
  {key: 'impulse_error.rms', name: 'Error of impulses (RMS)', text: ratio, tick: ratio,
    note: 'RMS over the matched collisions of the relative error, each against the exact impulse on the variant’s own path.'},
  {key: 'band_error_db', name: 'Third-octave error', text: levelDifference, tick: levelDifference, relative: true,
    note: 'RMS over the third-octave bands of the difference in level from the reference.'},
  {key: 'energy_drift', name: 'Energy drift', text: ratio, tick: ratio,
    note: 'Mechanical energy less the reference’s where the comparison ends, over the reference’s largest kinetic energy; its magnitude is plotted.'},
  {key: 'position_error', name: 'Error of the jello’s places', text: metres, tick: metres, relative: true,
    note: 'RMS over the points of the jello, and over time, of the distance from the reference’s.'},
];

const isReference = (view, variant) => variant.id === view.scene.reference;

/** {variant, x, y} of a variant; y is null where nothing was measured. */
function placed(view, measure, variant) {
  let error = at(variant, measure.key);
  if (error === null && measure.relative && isReference(view, variant)) error = 0;
  return {variant, x: at(variant, 'run_time.total'), y: error === null ? null : Math.abs(error)};
}

/** Why a point is not on logarithmic axes; empty if it is. */
function reasonOff(view, measure, point) {
  if (point.x > 0 && point.y > 0) return '';
  if (isReference(view, point.variant) && !(point.y > 0) && measure.key !== 'energy_drift') return 'The reference itself';
  if (point.y === null) return 'Not measured';
  if (point.y === 0) return 'Exact: 0';
  return 'Run time not measured';
}

/** Points for the plot, those with an error of zero (faster ones of which end the front), and what is left, by reason. */
function sortOut(view, measure, hidden) {
  const plotted = [], exact = [], off = new Map();
  for (const variant of view.scene.variants) {
    const point = placed(view, measure, variant);
    const reason = reasonOff(view, measure, point);
    if (reason) off.set(reason, [...(off.get(reason) || []), variant]);
    if (hidden.has(variant.group)) continue;
    if (!reason) plotted.push(point);
    else if (point.x > 0 && point.y === 0) exact.push(point);
  }
  return {plotted, exact, off, front: paretoFront(plotted, exact)};
}

/** The points which no other beats: none is as good in both and better in one. From the fastest to the most exact. */
function paretoFront(plotted, exact) {
  const all = plotted.concat(exact);
  const beats = (q, p) => q.x <= p.x && q.y <= p.y && (q.x < p.x || q.y < p.y);
  return plotted.filter((p) => !all.some((q) => beats(q, p))).sort((a, b) => a.x - b.x);
}

// ---- Colours ----

const SHAPES = ['circle', 'rect', 'triangle', 'rectRot', 'crossRot', 'star'];
const GROUPS = ['mechanics', 'sound', 'modes', 'jello', 'presets'];  // keep their colours on every scene

const groupIndex = (group) => (GROUPS.includes(group) ? GROUPS.indexOf(group) : GROUPS.length);
const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue('--' + name).trim();
const groupColour = (group) => colour('group-' + groupIndex(group));
const FONT = '12px system-ui, -apple-system, "Segoe UI", Roboto, "Liberation Sans", sans-serif';

function shapeIcon(group) {
  const paths = ['M6.5 1a5.5 5.5 0 1 0 .01 0z', 'M2 2h9v9h-9z', 'M6.5 1l5.5 10h-11z', 'M6.5 0l6.5 6.5-6.5 6.5-6.5-6.5z', 'M2 2l9 9M11 2l-9 9', 'M6.5 0v13M0 6.5h13M2 2l9 9M11 2l-9 9'];
  const svg = document.createElementNS('http://www.w3.org/2000/svg', 'svg');
  const path = document.createElementNS('http://www.w3.org/2000/svg', 'path');
  const index = groupIndex(group);
  svg.setAttribute('viewBox', '0 0 13 13');
  svg.setAttribute('aria-hidden', 'true');
  path.setAttribute('d', paths[index]);
  path.setAttribute('style', `fill: ${index > 3 ? 'none' : `var(--group-${index})`}; stroke: var(--group-${index}); stroke-width: ${index > 3 ? 2 : 0}`);
  svg.append(path);
  return svg;
}

/** Perceptually uniform, from nine anchors of viridis; `t` from 0 to 1. */
const VIRIDIS = [[68, 1, 84], [71, 44, 122], [59, 81, 139], [44, 113, 142], [33, 144, 141], [39, 173, 129], [92, 200, 99], [170, 220, 50], [253, 231, 37]];
function viridis(t) {
  const place = Math.min(Math.max(t, 0), 1) * (VIRIDIS.length - 1);
  const i = Math.min(Math.floor(place), VIRIDIS.length - 2);
  return VIRIDIS[i].map((low, channel) => Math.round(low + (VIRIDIS[i + 1][channel] - low) * (place - i)));
}

// ---- Axes ----

/** A range for a logarithmic axis: some room around the values, and never less than a decade. */
function logRange(values) {
  let low = Math.log10(Math.min(...values)) - 0.15, high = Math.log10(Math.max(...values)) + 0.15;
  const missing = Math.max(0, 1.05 - (high - low)) / 2;
  return {min: 10 ** (low - missing), max: 10 ** (high + missing)};
}

/** Powers of ten between the ends; with 2 and 5 where there are few, and fewer where there are many. */
function logTicks(min, max) {
  const first = Math.floor(Math.log10(min)), last = Math.ceil(Math.log10(max));
  const mantissas = last - first <= 3 ? [1, 2, 5] : [1];
  const stride = Math.ceil((last - first) / 9);
  const ticks = [];
  for (let power = first; power <= last; power += stride) {
    for (const m of mantissas) ticks.push(Number(`${m}e${power}`));
  }
  return ticks.filter((tick) => tick >= min && tick <= max);
}

/** Round numbers from `min` to `max`, about `wanted` of them. */
function linearTicks(min, max, wanted) {
  const rough = (max - min) / wanted, power = 10 ** Math.floor(Math.log10(rough));
  const step = power * [1, 2, 5, 10].find((m) => m * power >= rough * 0.999);
  const ticks = [];
  for (let i = Math.ceil(min / step - 1e-9); i * step <= max + step * 1e-6; i++) ticks.push(i * step);
  return ticks;
}

// A tick is a round number: no digits behind it.
const roundTick = (text) => text.replace(/\.0+(?=\D|$)/, '').replace(/(\.\d*?[1-9])0+(?=\D|$)/, '$1');

function logAxis(title, text, range) {
  return {
    type: 'logarithmic', ...range,
    title: {display: true, text: title, color: colour('soft')},
    grid: {color: colour('faint'), tickColor: colour('line')}, border: {color: colour('line')},
    ticks: {color: colour('soft'), autoSkip: false, maxRotation: 0, callback: (value) => roundTick(text(value))},
    afterBuildTicks: (axis) => { axis.ticks = logTicks(axis.min, axis.max).map((value) => ({value})); },
  };
}

// ---- The plot of error against run time ----

/** Lines at a run time: of the reference, and where a second takes a second. */
const linesPlugin = (view) => ({
  id: 'lines',
  beforeDatasetsDraw(chart) {
    const total = at(view.reference, 'run_time.total');
    drawLine(chart, 1, 'real time', 1);
    if (total > 0) drawLine(chart, total, 'reference', 0);
  },
});

function drawLine(chart, value, label, row) {
  const {ctx, chartArea: area, scales: {x}} = chart;
  if (value < x.min || value > x.max) return;
  const place = Math.round(x.getPixelForValue(value)) + 0.5;
  ctx.save();
  ctx.strokeStyle = ctx.fillStyle = colour('soft');
  ctx.setLineDash(row ? [2, 3] : [6, 4]);
  ctx.beginPath();
  ctx.moveTo(place, area.top);
  ctx.lineTo(place, area.bottom);
  ctx.stroke();
  ctx.font = FONT;
  const half = ctx.measureText(label).width / 2;  // above the plot, where no point is
  ctx.textAlign = 'center';
  ctx.fillText(label, Math.min(place, area.right - half), area.top - 5 - 15 * row);
  ctx.restore();
}

/** The stepped line: up from the fastest, and on to the right or down to where an exact variant takes over. */
function frontLine(front, exact, ranges) {
  if (!front.length) return [];
  const first = front[0], last = front[front.length - 1];
  const line = [{x: first.x, y: ranges.y.max}, ...front];
  const end = Math.min(...exact.map((point) => point.x), Infinity);
  if (end < ranges.x.max) line.push({x: end, y: last.y}, {x: end, y: ranges.y.min});
  else line.push({x: ranges.x.max, y: last.y});
  return line;
}

function pointSets(view, plotted) {
  const groups = [...new Set(plotted.map((point) => point.variant.group))];
  const isSelected = (context) => context.raw && context.raw.variant === view.selected;
  return groups.map((group) => ({
    label: group, points: true, order: 0,
    data: plotted.filter((point) => point.variant.group === group),
    pointStyle: SHAPES[groupIndex(group)],
    backgroundColor: groupColour(group),
    borderColor: (context) => (isSelected(context) ? colour('ink') : groupIndex(group) > 3 ? groupColour(group) : colour('paper')),
    pointBorderWidth: (context) => (isSelected(context) || groupIndex(group) > 3 ? 2 : 1),
    pointRadius: (context) => (isSelected(context) ? 8 : 5),
    pointHoverRadius: 8, pointHitRadius: 9,
  }));
}

function drawPlot(view) {
  if (view.chart) view.chart.destroy();
  view.chart = null;
  view.tip.hidden = true;
  const sorted = sortOut(view, view.measure, view.hidden);
  view.front = sorted.front;
  view.plotBox.hidden = sorted.plotted.length === 0;
  showBeneath(view, sorted);
  if (!sorted.plotted.length) return;
  const times = sorted.plotted.map((point) => point.x).concat(at(view.reference, 'run_time.total') || []);
  const ranges = {x: logRange(times), y: logRange(sorted.plotted.map((point) => point.y))};
  const frontSet = {label: 'front', type: 'line', order: 1, stepped: true, data: frontLine(sorted.front, sorted.exact, ranges),
    borderColor: colour('front'), borderWidth: 1.5, pointRadius: 0, pointHitRadius: 0, pointHoverRadius: 0};
  view.plotCanvas.setAttribute('aria-label', `${view.measure.name} against run time of ${sorted.plotted.length} variants, ${sorted.front.length} of them on the Pareto front; the table below has the numbers.`);
  view.chart = new Chart(view.plotCanvas, {
    type: 'scatter', data: {datasets: [...pointSets(view, sorted.plotted), frontSet]},
    options: {
      animation: false, responsive: true, maintainAspectRatio: false, font: {family: 'system-ui, sans-serif'},
      layout: {padding: {top: 34}},  // of the lines' names
      interaction: {mode: 'nearest', intersect: true},
      onClick: (event, hits) => { if (hits.length) select(view, hits[0].element.$context.raw.variant); },
      onHover: (event, hits) => { view.plotCanvas.style.cursor = hits.length ? 'pointer' : ''; },
      plugins: {legend: {display: false}, tooltip: {enabled: false, external: (context) => showTip(view, context)}},
      scales: {
        x: logAxis('Run time: seconds per simulated second', seconds, ranges.x),
        y: logAxis(view.measure.name, view.measure.tick, ranges.y),
      },
    },
    plugins: [linesPlugin(view)],
  });
}

function showTip(view, {chart, tooltip}) {
  const hits = (tooltip.dataPoints || []).map((hit) => hit.raw.variant).filter(Boolean);
  view.tip.hidden = tooltip.opacity === 0 || !hits.length;
  if (view.tip.hidden) return;
  view.tip.replaceChildren(make('strong', {}, hits[0].label), factsList(view, hits[0]), choicesText(hits[0]),
    ...hits.slice(1).map((variant) => make('div', {}, `Also here: ${variant.label}`)));
  const left = tooltip.caretX > chart.width / 2 ? tooltip.caretX - view.tip.offsetWidth - 14 : tooltip.caretX + 14;
  view.tip.style.left = Math.max(0, Math.min(left, chart.width - view.tip.offsetWidth)) + 'px';
  view.tip.style.top = Math.max(0, Math.min(tooltip.caretY - 20, chart.height - view.tip.offsetHeight)) + 'px';
}

function pickButton(view, variant) {
  return make('button', {type: 'button', class: 'link', 'data-pick': variant.id, click: () => select(view, variant)}, variant.label);
}

function showBeneath(view, sorted) {
  const text = view.measure.text;
  view.measureNote.textContent = view.measure.note;
  const items = sorted.front.map((point) => make('li', {}, pickButton(view, point.variant), ' ', make('span', {}, `${seconds(point.x)}, ${text(point.y)}`)));
  const lead = items.length ? 'On the front, from the fastest to the most exact:' : 'No point has both a run time and an error above zero, so that nothing can be plotted.';
  const beaten = items.length || !sorted.plotted.length ? lead : 'No plotted variant is on the front: an exact one is faster than all.';
  const reasons = [...sorted.off].map(([reason, variants]) => [make('dt', {}, reason),
    make('dd', {}, variants.flatMap((variant, i) => [i ? ' · ' : '', pickButton(view, variant)]))]);
  view.beneath.replaceChildren(make('p', {class: 'plot-note'}, beaten), make('ol', {class: 'front-list'}, items),
    ...(reasons.length ? [folded(`Not on logarithmic axes: ${numbered([...sorted.off.values()].flat().length, 'variant')}`, make('dl', {class: 'unplotted'}, reasons.flat()))] : []));
}

// ---- One variant in words ----

function factsOf(variant) {
  const v = (path) => at(variant, path);
  const pair = (path, text) => (v(path + '.rms') === null && v(path + '.max') === null ? null : `${shown(v(path + '.rms'), text)} RMS, ${shown(v(path + '.max'), text)} at most`);
  const parts = [['mechanics', v('run_time.mechanics')], ['sound', v('run_time.sound')]].filter(([, value]) => value !== null);
  const total = v('run_time.total');
  return [
    ['Run time', total === null ? null : [`${seconds(total)} per s`, speed(total)].filter(Boolean).join(', ')],
    ['of which', parts.length ? parts.map(([name, value]) => `${name} ${seconds(value)}`).join(', ') : null],
    ['Spread', v('run_time.spread') === null ? null : ratio(v('run_time.spread')) + (v('run_time.runs') === null ? '' : ` over ${v('run_time.runs')} runs`)],
    ['Memory', v('memory') === null ? null : bytes(v('memory'))],
    ['Collisions', at(variant, 'events.reference') === null ? null : `${shown(v('events.matched'), count)} of ${v('events.reference')} matched, ${shown(v('events.missed'), count)} missed, ${shown(v('events.spurious'), count)} spurious`],
    ['Times', pair('event_time_error', seconds)],
    ['Impulses', pair('impulse_error', ratio)],
    ['Same path', v('local_waveform_error') === null ? null : MEASURES[0].text(v('local_waveform_error'))],
    ['Waveform', v('waveform_error') === null ? null : MEASURES[0].text(v('waveform_error')) + (v('compared_until') === null ? '' : `, up to ${seconds(v('compared_until'))}`)],
    ['Aligned', v('aligned_waveform_error') === null ? null : MEASURES[0].text(v('aligned_waveform_error')) + (v('delay') === null ? '' : `, ${seconds(v('delay'))} late`)],
    ['Third octaves', v('band_error_db') === null ? null : levelDifference(v('band_error_db')) + ' RMS'],
    ['Motion parts', v('diverged_at') === null ? null : 'at ' + seconds(v('diverged_at'))],
    ['Energy drift', v('energy_drift') === null ? null : ratio(v('energy_drift'))],
    ['Places', v('position_error') === null ? null : metres(v('position_error')) + ' RMS'],
  ];
}

function factsList(view, variant) {
  const rows = factsOf(variant).filter(([, text]) => text !== null);
  return make('dl', {class: 'facts-list'}, rows.flatMap(([name, text]) => [make('dt', {}, name), make('dd', {}, text)]));
}

function choiceText(key, value) {
  if (typeof value === 'boolean') return value ? 'yes' : 'no';
  if (typeof value !== 'number') return spaced(value);
  return key === 'step' && value > 0 ? seconds(value) : simple(value);
}

function choicesText(variant) {
  const entries = Object.entries(variant.choices || {}).filter(([, value]) => value !== null);
  if (!entries.length) return null;
  return make('p', {class: 'choices'}, entries.flatMap(([key, value], i) => [i ? ' · ' : '', spaced(key) + ' ', make('b', {}, choiceText(key, value))]));
}

function drawCard(view) {
  const variant = view.selected;
  const note = isReference(view, variant) ? `${variant.group}; this is the reference` : variant.group;
  view.card.replaceChildren(...[make('h3', {}, variant.label), make('p', {class: 'hint'}, `Selected; group: ${note}`), factsList(view, variant), choicesText(variant),
    variant.notes && variant.notes.length ? make('ul', {}, variant.notes.map((text) => make('li', {}, text))) : null].filter(Boolean));
}

// ---- Waveforms and spectrograms ----

const MARGIN = {left: 52, right: 10, top: 6, bottom: 30};

/** A canvas at the screen's resolution, and the frame in it that is drawn in. */
function prepare(canvas) {
  const scale = window.devicePixelRatio || 1, width = canvas.clientWidth, height = canvas.clientHeight;
  canvas.width = Math.round(width * scale);
  canvas.height = Math.round(height * scale);
  const ctx = canvas.getContext('2d');
  ctx.setTransform(scale, 0, 0, scale, 0, 0);
  ctx.font = FONT.replace('12px', '11px');
  return {ctx, left: MARGIN.left, top: MARGIN.top, width: Math.max(1, width - MARGIN.left - MARGIN.right), height: Math.max(1, height - MARGIN.top - MARGIN.bottom)};
}

/** Ticks are {at: 0 to 1 along the axis, text}. */
function drawAxes(frame, xTicks, yTicks, yTitle) {
  const {ctx, left, top, width, height} = frame;
  ctx.strokeStyle = colour('line');
  ctx.strokeRect(left + 0.5, top + 0.5, width - 1, height - 1);
  ctx.fillStyle = colour('soft');
  ctx.textBaseline = 'middle';
  ctx.textAlign = 'right';
  for (const tick of yTicks) ctx.fillText(tick.text, left - 5, top + height * (1 - tick.at));
  ctx.textBaseline = 'top';
  ctx.textAlign = 'center';
  for (const tick of xTicks) ctx.fillText(tick.text, left + width * tick.at, top + height + 5);
  ctx.save();
  ctx.translate(10, top + height / 2);
  ctx.rotate(-Math.PI / 2);
  ctx.textBaseline = 'middle';
  ctx.fillText(yTitle, 0, 0);
  ctx.restore();
}

function timeTicks(frame, total) {
  const last = frame.width > 340 ? 6 : 4;
  return linearTicks(0, total, last).map((time) => ({at: time / total, text: roundTick(digits(time)) + THIN + 's'}));
}

function drawWave(canvas, wave, common) {
  const frame = prepare(canvas), {ctx, left, top, width, height} = frame;
  const power = common.peak > 0 ? 3 * Math.floor(Math.log10(common.peak) / 3 + 1e-9) : 0;
  const found = PREFIXES.find(([exponent]) => exponent === power) || [0, ''];
  const limit = common.peak > 0 ? common.peak * 1.08 : 1;
  const x = (i) => left + width * (wave.seconds / common.seconds) * (i / wave.columns);
  const y = (value) => top + height * (0.5 - 0.5 * value / limit);
  ctx.strokeStyle = colour('faint');
  ctx.beginPath();
  ctx.moveTo(left, y(0));
  ctx.lineTo(left + width, y(0));
  ctx.stroke();
  ctx.fillStyle = ctx.strokeStyle = colour('wave');
  ctx.beginPath();
  ctx.moveTo(x(0), y(wave.high[0]));
  for (let i = 0; i < wave.columns; i++) ctx.lineTo(x(i + 0.5), y(wave.high[i]));
  for (let i = wave.columns - 1; i >= 0; i--) ctx.lineTo(x(i + 0.5), y(wave.low[i]));
  ctx.closePath();
  ctx.lineWidth = 0.7;  // so that silence and single columns are seen
  ctx.fill();
  ctx.stroke();
  ctx.lineWidth = 1;
  const yTicks = linearTicks(-limit, limit, 4).map((value) => ({at: 0.5 + 0.5 * value / limit, text: roundTick(digits(Number((value / 10 ** found[0]).toPrecision(3))))}));
  drawAxes(frame, timeTicks(frame, common.seconds), yTicks, 'in ' + found[1] + 'Pa');
}

/** The bytes as an image with a pixel for each, coloured on the scale that both panes share. */
function spectrumImage(spectrum, common) {
  const image = new ImageData(spectrum.columns, spectrum.rows);
  const span = common.highDb - common.lowDb;
  for (let column = 0; column < spectrum.columns; column++) {
    for (let row = 0; row < spectrum.rows; row++) {
      const db = spectrum.low_db + spectrum.bytes[column * spectrum.rows + row] / 255 * (spectrum.high_db - spectrum.low_db);
      image.data.set([...viridis((db - common.lowDb) / span), 255], 4 * ((spectrum.rows - 1 - row) * spectrum.columns + column));
    }
  }
  const canvas = make('canvas', {width: spectrum.columns, height: spectrum.rows});
  canvas.getContext('2d').putImageData(image, 0, 0);
  return canvas;
}

function drawSpectrum(canvas, spectrum, common) {
  const frame = prepare(canvas), {ctx, left, top, width, height} = frame;
  const octaves = Math.log(common.high / common.low);
  const place = (frequency) => Math.log(frequency / common.low) / octaves;
  ctx.fillStyle = `rgb(${viridis(0)})`;
  ctx.fillRect(left, top, width, height);
  const bottom = place(spectrum.low_frequency), upper = place(spectrum.high_frequency);
  ctx.drawImage(spectrumImage(spectrum, common), left, top + height * (1 - upper), width * spectrum.seconds / common.seconds, height * (upper - bottom));
  const yTicks = [20, 50, 100, 200, 500, 1000, 2000, 5000, 10000, 20000].filter((f) => f >= common.low && f <= common.high)
    .map((f) => ({at: place(f), text: f >= 1000 ? f / 1000 + 'k' : String(f)}));
  drawAxes(frame, timeTicks(frame, common.seconds), yTicks, 'frequency in hertz');
}

const positive = (...values) => values.every((value) => typeof value === 'number' && value > 0 && Number.isFinite(value));

function goodWave(wave) {
  const full = (list) => Array.isArray(list) && list.length === wave.columns && list.every(Number.isFinite);
  return wave && positive(wave.columns, wave.seconds) && full(wave.low) && full(wave.high) ? wave : null;
}

/** With its bytes decoded (once); null if they are not what the header says. */
function goodSpectrum(spectrum) {
  if (!spectrum || !positive(spectrum.columns, spectrum.rows, spectrum.seconds, spectrum.low_frequency, spectrum.high_frequency - spectrum.low_frequency, spectrum.high_db - spectrum.low_db)) return null;
  try {
    if (!spectrum.bytes) spectrum.bytes = Uint8Array.from(atob(spectrum.data), (c) => c.charCodeAt(0));
  } catch (error) {
    return null;
  }
  return spectrum.bytes.length === spectrum.columns * spectrum.rows ? spectrum : null;
}

/** The scales that both panes share. */
function commonScales(panes) {
  const waves = panes.map((pane) => pane.wave).filter(Boolean), spectra = panes.map((pane) => pane.spectrum).filter(Boolean);
  return {
    seconds: Math.max(...[...waves, ...spectra].map((item) => item.seconds)),
    peak: waves.reduce((peak, wave) => [...wave.low, ...wave.high].reduce((most, value) => Math.max(most, Math.abs(value)), peak), 0),
    low: Math.min(...spectra.map((s) => s.low_frequency)), high: Math.max(...spectra.map((s) => s.high_frequency)),
    lowDb: Math.min(...spectra.map((s) => s.low_db)), highDb: Math.max(...spectra.map((s) => s.high_db)),
  };
}

// ---- Players ----

/** The player of a variant, made when first wanted; null if there is no sound of it. */
function playerOf(view, variant) {
  const media = mediaOf(view, variant);
  if (!media || !media.audio) return null;
  if (!view.players.has(variant.id)) {
    const player = make('audio', {controls: true, preload: 'metadata', src: media.audio, 'aria-label': `Sound of ${variant.label}`});
    player.addEventListener('play', () => started(player));
    player.addEventListener('pause', () => markHeard(view));
    player.addEventListener('error', () => player.after(make('p', {class: 'failure'}, 'This sound does not load.')));
    view.players.set(variant.id, player);
  }
  return view.players.get(variant.id);
}

const mediaOf = (view, variant) => view.media[`${view.scene.name}/${variant.id}`] || null;
const play = (player) => player.play().catch(() => {});  // stopped before it began, or not to be decoded, which `error` shows

/** One sound at a time on the whole page. */
function started(player) {
  for (const view of views) {
    for (const other of view.players.values()) if (other !== player) other.pause();
    markHeard(view);
  }
}

function markHeard(view) {
  for (const pane of view.panes) {
    const heard = pane.player !== null && !pane.player.paused;
    pane.box.classList.toggle('heard', heard);
    if (heard) followPlayer(pane);
  }
}

/** Moves the cursor over the pictures while the sound runs. */
function followPlayer(pane) {
  if (pane.following) return;
  pane.following = true;
  const step = () => {
    pane.following = pane.player !== null && !pane.player.paused;
    for (const stack of pane.box.querySelectorAll('.stack')) {
      const cursor = stack.querySelector('.cursor'), width = stack.clientWidth - MARGIN.left - MARGIN.right;
      cursor.style.display = 'block';
      cursor.style.left = MARGIN.left + width * Math.min(1, pane.player.currentTime / pane.seconds) + 'px';
    }
    if (pane.following) requestAnimationFrame(step);
  };
  requestAnimationFrame(step);
}

/** The other one of the two, from where the first one is; the reference if neither runs. */
function switchPlayers(view) {
  const [first, second] = view.panes.map((pane) => pane.player);
  const running = [first, second].find((player) => !player.paused);
  const next = running === first ? second : first;
  if (running) next.currentTime = running.currentTime;
  play(next);
}

function seek(pane, event) {
  const width = event.currentTarget.clientWidth - MARGIN.left - MARGIN.right;
  const time = (event.offsetX - MARGIN.left) / width * pane.seconds;
  if (pane.player) pane.player.currentTime = Math.max(0, Math.min(time, pane.player.duration || 0));
}

// ---- The two panes ----

function makePane(view, variant, title) {
  const media = mediaOf(view, variant) || {};
  const pane = {variant, player: playerOf(view, variant), wave: goodWave(media.waveform), spectrum: goodSpectrum(media.spectrogram), following: false, seconds: 1};
  const stack = (kind, name) => make('div', {class: 'stack', click: (event) => seek(pane, event)},
    make('canvas', {class: kind, role: 'img', 'aria-label': `${name} of ${variant.label}`}), make('div', {class: 'cursor'}));
  const missing = (given, name) => make('p', {class: given ? 'failure' : 'note'}, given ? `The ${name} is damaged.` : `No ${name} of this variant was kept.`);
  pane.box = make('div', {class: 'pane'}, make('h4', {}, make('span', {}, title + ' '), variant.label),
    pane.wave ? stack('wave', 'Waveform') : missing(media.waveform, 'waveform'),
    pane.spectrum ? stack('spectrum', 'Spectrogram') : missing(media.spectrogram, 'spectrogram'),
    pane.player || missing(false, 'sound'));
  return pane;
}

function drawPanes(view) {
  const same = isReference(view, view.selected);
  view.panes = [makePane(view, view.reference, 'Reference')];
  if (!same) view.panes.push(makePane(view, view.selected, 'Selected'));
  const other = same ? make('p', {class: 'note'}, 'The selected variant is the reference itself. Pick another one in the plot or in the table.') : view.panes[1].box;
  view.pair.replaceChildren(view.panes[0].box, other);
  drawPlayerLink(view);
  view.switchButton.disabled = same || !view.panes.every((pane) => pane.player);
  redrawPanes(view);
}

/** The address of the page in which these variants are seen and heard; null if one of them is not in it. */
function playerAddress(view, ids) {
  const shown = view.scene.shown || [];
  if (!view.scene.page || !ids.every((id) => shown.includes(id))) return null;
  return `${encodeURIComponent(view.scene.page)}#runs=${ids.map(encodeURIComponent).join(',')}`;
}

function drawPlayerLink(view) {
  const ids = [...new Set([view.reference.id, view.selected.id])];
  const address = playerAddress(view, ids);
  const words = ids.length > 1 ? 'See and hear both in the player' : 'See and hear it in the player';
  const reason = view.scene.page ? 'The player’s page was full before this variant.' : 'This report was made without the player.';
  view.playerLink.replaceChildren(address ? make('a', {class: 'button', href: address, target: '_blank', rel: 'noopener'}, words) : make('span', {class: 'hint'}, reason));
}

function redrawPanes(view) {
  const common = commonScales(view.panes);
  for (const pane of view.panes) {
    pane.seconds = common.seconds;
    if (pane.wave) drawWave(pane.box.querySelector('.wave'), pane.wave, common);
    if (pane.spectrum) drawSpectrum(pane.box.querySelector('.spectrum'), pane.spectrum, common);
  }
  const some = Number.isFinite(common.lowDb);
  view.scaleBar.hidden = !some;
  if (some) view.scaleBar.replaceChildren(`${minus(String(common.lowDb))}`, make('i', {style: `background: linear-gradient(to right, ${VIRIDIS.map((c) => `rgb(${c})`)})`}), `${common.highDb}${THIN}dB re 20${THIN}µPa`);
}

function drawBands(view) {
  if (view.bandChart) view.bandChart.destroy();
  view.bandChart = null;
  const bands = view.selected.bands || [];
  view.bandBox.hidden = !bands.length;
  view.bandNote.textContent = bands.length ? `Level of ${view.selected.label} less that of the reference.` : 'Not measured for the selected variant.';
  if (!bands.length) return;
  const axis = (title) => ({title: {display: true, text: title, color: colour('soft')}, ticks: {color: colour('soft'), maxRotation: 0}, grid: {color: colour('faint')}, border: {color: colour('line')}});
  view.bandCanvas.setAttribute('aria-label', `Differences of third-octave levels: ${bands.map((b) => `${b.frequency} Hz ${shown(b.difference_db, levelDifference)}`).join(', ')}`);
  view.bandChart = new Chart(view.bandCanvas, {
    type: 'bar',
    data: {labels: bands.map((b) => (b.frequency >= 1000 ? Number((b.frequency / 1000).toPrecision(3)) + 'k' : String(Number(b.frequency.toPrecision(3))))),
      datasets: [{data: bands.map((b) => b.difference_db), backgroundColor: colour('wave'), categoryPercentage: 0.9, barPercentage: 0.9}]},
    options: {animation: false, responsive: true, maintainAspectRatio: false, scales: {x: {...axis('frequency in hertz'), grid: {display: false}}, y: axis('difference in dB')},
      interaction: {mode: 'index', intersect: false},
      plugins: {legend: {display: false}, tooltip: {displayColors: false, callbacks: {title: (items) => items[0].label + THIN + 'Hz', label: (item) => shown(bands[item.dataIndex].difference_db, levelDifference)}}}},
  });
}

// ---- The table ----

const COLUMNS = [
  {key: 'label', head: 'Variant', text: String, words: true},
  {key: 'group', head: 'Group', text: String, words: true},
  {key: 'run_time.total', over: 'Run time per simulated s', head: 'total', text: seconds},
  {key: 'run_time.mechanics', over: 'Run time per simulated s', head: 'mechanics', text: seconds},
  {key: 'run_time.sound', over: 'Run time per simulated s', head: 'sound', text: seconds},
  {key: 'run_time.spread', over: 'Run time per simulated s', head: 'spread', text: ratio},
  {key: 'memory', head: 'Memory', text: bytes},
  {key: 'waveform_error', over: 'Waveform error', head: 'reference', text: ratio},
  {key: 'aligned_waveform_error', over: 'Waveform error', head: 'aligned', text: ratio},
  {key: 'local_waveform_error', over: 'Waveform error', head: 'same path', text: ratio},
  {key: 'band_error_db', head: 'Third octaves', text: levelDifference},
  {key: 'events.missed', over: 'Collisions', head: 'missed', text: count},
  {key: 'events.spurious', over: 'Collisions', head: 'spurious', text: count},
  {key: 'event_time_error.rms', over: 'Error of times', head: 'RMS', text: seconds},
  {key: 'event_time_error.max', over: 'Error of times', head: 'max', text: seconds},
  {key: 'impulse_error.rms', over: 'Error of impulses', head: 'RMS', text: ratio},
  {key: 'impulse_error.max', over: 'Error of impulses', head: 'max', text: ratio},
  {key: 'diverged_at', head: 'Parts at', text: seconds},
  {key: 'energy_drift', head: 'Energy drift', text: ratio},
  {key: 'position_error', head: 'Places', text: metres},
];

/** Ascending order of values; null is after everything, in either direction. */
function compare(a, b, descending) {
  if (a === null || b === null) return (a === null) - (b === null);
  const order = typeof a === 'string' ? a.localeCompare(b, 'en', {numeric: true}) : a - b;
  return descending ? -order : order;
}

function sortTable(view, column, header) {
  const descending = header.getAttribute('aria-sort') === 'ascending';
  for (const other of view.table.tHead.querySelectorAll('[aria-sort]')) other.setAttribute('aria-sort', 'none');
  header.setAttribute('aria-sort', descending ? 'descending' : 'ascending');
  const rows = view.scene.variants.slice().sort((a, b) => compare(at(a, column.key), at(b, column.key), descending));
  view.table.tBodies[0].append(...rows.map((variant) => view.rows.get(variant.id)));
}

function headCell(view, column, rowspan) {
  const header = make('th', {scope: 'col', rowspan, 'aria-sort': 'none', 'data-key': column.key, class: column.key === 'label' ? 'first' : column.words ? 'text' : null});
  header.append(make('button', {type: 'button', click: () => sortTable(view, column, header)}, column.head));
  return header;
}

/** Two rows of headings: columns under a common one, and columns that take both rows. */
function tableHead(view, columns, listen) {
  const upper = make('tr'), lower = make('tr');
  for (const column of columns) {
    if (!column.over) upper.append(headCell(view, column, 2));
    else {
      const together = columns.filter((other) => other.over === column.over);
      if (together[0] === column) upper.append(make('th', {scope: 'colgroup', colspan: together.length, class: 'over'}, column.over));
      lower.append(headCell(view, column));
    }
  }
  if (listen) upper.append(make('th', {scope: 'col', rowspan: 2}, 'Listen'));
  return make('thead', {}, upper, lower);
}

function bodyCell(view, variant, column) {
  const value = at(variant, column.key);
  const attributes = {'data-key': column.key, 'data-value': JSON.stringify(value), class: value === null ? 'null' : column.words ? 'text' : null};
  if (column.key === 'label') return make('th', {...attributes, scope: 'row', class: 'first'}, pickButton(view, variant));
  return make('td', attributes, shown(value, column.text));
}

function listenCell(view, variant) {
  const media = mediaOf(view, variant);
  if (!media || !media.audio) return make('td', {class: 'null'}, '–');
  const listen = () => { select(view, variant); const player = playerOf(view, variant); player.currentTime = 0; play(player); };
  return make('td', {}, make('button', {type: 'button', class: 'link', 'aria-label': `Listen to ${variant.label}`, click: listen}, '▶'));
}

function makeTable(view) {
  const variants = view.scene.variants;
  const columns = COLUMNS.filter((column) => column.words || variants.some((variant) => at(variant, column.key) !== null));
  const absent = COLUMNS.filter((column) => !columns.includes(column)).map((column) => (column.over ? `${column.over}: ${column.head}` : column.head));
  const listen = variants.some((variant) => (mediaOf(view, variant) || {}).audio);
  for (const variant of variants) {
    const row = make('tr', {'data-id': variant.id, class: isReference(view, variant) ? 'reference' : null}, columns.map((column) => bodyCell(view, variant, column)));
    if (listen) row.append(listenCell(view, variant));
    view.rows.set(variant.id, row);
  }
  view.table = make('table', {'data-scene': view.scene.name}, make('caption', {}, `All ${variants.length} variants of ${spaced(view.scene.name)}. A heading sorts by its column; – is what was not measured.`
    + (absent.length ? ` Not measured in this scene: ${absent.join('; ')}.` : '')), tableHead(view, columns, listen), make('tbody', {}, [...view.rows.values()]));
  return make('div', {class: 'scroll', tabindex: 0, role: 'region', 'aria-label': `Table of variants of ${spaced(view.scene.name)}`}, view.table);
}

// ---- Scenes ----

const views = [];

/** Shows a variant beside the reference; a sound that runs goes on in the new one. */
function select(view, variant) {
  const before = view.selected && view.selected !== variant && !isReference(view, view.selected) ? playerOf(view, view.selected) : null;
  const next = playerOf(view, variant);
  view.selected = variant;
  if (before && !before.paused) {
    before.pause();
    if (next) { next.currentTime = before.currentTime; play(next); }
  }
  for (const [id, row] of view.rows) row.classList.toggle('selected', id === variant.id);
  for (const button of view.section.querySelectorAll('[data-pick]')) button.setAttribute('aria-pressed', String(button.dataset.pick === variant.id));
  if (view.chart) view.chart.update('none');
  drawCard(view);
  drawPanes(view);
  drawBands(view);
  markHeard(view);
}

function planOf(scene) {
  const plan = scene.plan || {};
  const left = plan.left_out || [];
  const unrun = scene.variants_left_out || [];
  return make('div', {}, make('h3', {}, 'Plan'), make('ol', {class: 'plan', 'aria-label': 'Stages in order'}, (plan.needed || []).map((stage) => make('li', {}, spaced(stage)))),
    left.length ? folded(`${numbered(left.length, 'stage')} left out`, make('ul', {class: 'left-out'}, left.map((item) => make('li', {}, `${spaced(item.stage)}: ${item.why}`))))
      : make('p', {class: 'note'}, 'Nothing was left out.'),
    unrun.length ? folded(`${numbered(unrun.length, 'variant')} not run`, make('ul', {class: 'left-out'}, unrun.map((item) => make('li', {}, `${item.label}: ${item.why}`))))
      : make('p', {class: 'note'}, 'Every variant was run.'));
}

function referenceOf(view) {
  return make('div', {}, make('h3', {}, 'Reference'), make('p', {}, make('strong', {}, view.reference.label), view.scene.reference_why ? '. ' + view.scene.reference_why : '.'));
}

function sceneFacts(scene) {
  const channels = {1: 'mono', 2: 'stereo'}[scene.channels] || (scene.channels ? `${scene.channels} channels` : null);
  return [scene.duration ? simple(scene.duration) + THIN + 's' : null, scene.sample_rate ? simple(scene.sample_rate / 1000) + THIN + 'kHz' : null, channels, `${scene.variants.length} variants`].filter(Boolean).join(' · ');
}

function makeControls(view) {
  const id = `measure-${views.length}`;
  const change = (event) => { view.measure = MEASURES[event.target.selectedIndex]; drawPlot(view); };
  const options = MEASURES.map((measure) => make('option', {value: measure.key, selected: measure === view.measure}, measure.name));
  const groups = [...new Set(view.scene.variants.map((variant) => variant.group))];
  const toggle = (group) => (event) => { view.hidden[event.target.checked ? 'delete' : 'add'](group); drawPlot(view); };
  return make('div', {class: 'controls'}, make('span', {}, make('label', {for: id}, 'Error: '), make('select', {id, change}, options)),
    make('fieldset', {class: 'legend'}, make('legend', {}, 'Groups'), groups.map((group) => make('label', {}, make('input', {type: 'checkbox', checked: true, change: toggle(group)}), shapeIcon(group), spaced(group)))));
}

function makeView(scene, media) {
  const view = {scene, media, hidden: new Set(), players: new Map(), rows: new Map(), panes: [], chart: null, bandChart: null, selected: null, front: []};
  view.reference = scene.variants.find((variant) => variant.id === scene.reference);
  view.measure = MEASURES.find((measure) => sortOut(view, measure, view.hidden).plotted.length) || MEASURES[0];
  view.plotCanvas = make('canvas', {role: 'img'});
  view.tip = make('div', {class: 'tip', hidden: true});
  view.plotBox = make('div', {class: 'plot'}, view.plotCanvas, view.tip);
  view.measureNote = make('p', {class: 'note'});
  view.beneath = make('div', {});
  view.card = make('div', {class: 'card', 'aria-live': 'polite'});
  view.pair = make('div', {class: 'pair'});
  view.switchButton = make('button', {type: 'button', class: 'button', click: () => switchPlayers(view)}, 'Play, then switch A/B');
  view.playerLink = make('span', {class: 'player'});
  view.scaleBar = make('span', {class: 'scale'});
  view.bandCanvas = make('canvas', {role: 'img'});
  view.bandBox = make('div', {class: 'bands'}, view.bandCanvas);
  view.bandNote = make('p', {class: 'note'});
  return view;
}

function assemble(view) {
  const id = 'scene-' + view.scene.name.replace(/\s/g, '_');
  view.section = make('section', {class: 'scene', id, 'aria-labelledby': id + '-title'},
    make('h2', {id: id + '-title'}, spaced(view.scene.name)), make('p', {class: 'description'}, view.scene.description || ''), make('p', {class: 'facts'}, sceneFacts(view.scene)),
    make('div', {class: 'two-facts'}, referenceOf(view), planOf(view.scene)),
    make('h3', {}, 'Error against run time'), makeControls(view), view.measureNote,
    make('div', {class: 'trade'}, make('div', {}, view.plotBox, view.beneath), view.card),
    make('h3', {}, 'Heard and seen'), view.pair,
    make('div', {class: 'listen'}, view.switchButton, view.playerLink, make('span', {class: 'hint'}, 'Each press goes to the other sound at the same moment. A click in a picture goes there.'), view.scaleBar),
    make('h3', {}, 'Third-octave levels'), view.bandNote, view.bandBox,
    make('h3', {}, 'All variants'), makeTable(view));
  return view.section;
}

/** What is shown first: the most exact variant on the front, or else any but the reference. */
function firstSelection(view) {
  const last = view.front[view.front.length - 1];
  return last ? last.variant : view.scene.variants.find((variant) => !isReference(view, variant)) || view.reference;
}

function redraw() {
  for (const view of views) {
    drawPlot(view);
    redrawPanes(view);
    drawBands(view);
  }
}

/** Colours on canvases are not restyled by themselves; paper is always light. */
function followTheme() {
  const paper = (light) => () => {
    if (light) document.documentElement.dataset.theme = 'light';
    else delete document.documentElement.dataset.theme;
    redraw();
  };
  window.matchMedia('(prefers-color-scheme: dark)').addEventListener('change', redraw);
  window.addEventListener('beforeprint', paper(true));
  window.addEventListener('afterprint', paper(false));
}

function followWidth(view) {
  let width = view.pair.clientWidth;
  new ResizeObserver(() => {
    if (view.pair.clientWidth === width) return;
    width = view.pair.clientWidth;
    redrawPanes(view);
  }).observe(view.pair);
}

function showMachine(report) {
  const m = report.machine || {};
  const parts = [report.program, m.processor, m.cores ? `${m.cores} cores` : null, m.compiler, m.build ? `${m.build} build` : null];
  document.getElementById('machine').textContent = parts.filter(Boolean).join(' · ');
}

function show({report, media}) {
  const main = document.getElementById('scenes');
  showMachine(report);
  if (!report.scenes.length) main.append(make('p', {}, 'This report has no scenes.'));
  for (const scene of report.scenes) {
    const view = makeView(scene, media);
    main.append(assemble(view));
    views.push(view);
    drawPlot(view);
    select(view, firstSelection(view));
    followWidth(view);
  }
  const links = views.map((view) => make('li', {}, make('a', {href: '#' + encodeURIComponent(view.section.id)}, spaced(view.scene.name))));
  document.getElementById('contents').append(make('ul', {}, links));
  followTheme();
  const only = /^#only=(.+)$/.exec(location.hash);
  if (only) for (const view of views) view.section.hidden = view.scene.name !== decodeURIComponent(only[1]);
}

// ---- Self test: the page opened with #selftest says on <html> what it really shows ----

/** Whether a player's sound can be decoded and has a length. */
function loads(player) {
  const good = () => player.duration > 0 && Number.isFinite(player.duration);
  if (player.readyState > 0 || player.error) return Promise.resolve(good());
  return new Promise((resolve) => {
    player.addEventListener('loadedmetadata', () => resolve(good()));
    player.addEventListener('error', () => resolve(false));
    player.load();
  });
}

function hasPixels(canvas) {
  if (!canvas.width || !canvas.height) return false;
  const {data} = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
  return data.some((value, i) => i % 4 === 3 && value > 0);
}

/** The points whose places are in the area of the plot. */
function pointsDrawn(view) {
  if (!view.chart) return [];
  const {left, right, top, bottom} = view.chart.chartArea;
  const sets = view.chart.data.datasets.map((set, i) => (set.points ? view.chart.getDatasetMeta(i).data : [])).flat();
  return sets.filter((point) => point.x >= left && point.x <= right && point.y >= top && point.y <= bottom);
}

function frontDrawn(view) {
  if (!view.chart) return [];
  return view.chart.data.datasets.filter((set) => !set.points).flatMap((set) => set.data).filter((point) => point.variant);
}

/** Whether the rows, by what their cells hold, are in the order which the heading says. */
function inOrder(view, header) {
  const descending = header.getAttribute('aria-sort') === 'descending';
  const values = [...view.table.tBodies[0].rows].map((row) => JSON.parse([...row.cells].find((cell) => cell.dataset.key === header.dataset.key).dataset.value));
  const known = values.filter((value) => value !== null);
  const later = (a, b) => (typeof a === 'string' ? a.localeCompare(b, 'en', {numeric: true}) > 0 : a > b);
  const wrong = known.some((value, i) => i > 0 && (descending ? later(value, known[i - 1]) : later(known[i - 1], value)));
  return !wrong && values.slice(known.length).every((value) => value === null) && new Set(view.table.tBodies[0].rows).size === view.scene.variants.length;
}

/** Sorts by every heading in both directions; what went wrong, and how many sorts there were. */
function trySorts() {
  const wrong = [];
  let sorts = 0;
  for (const view of views) {
    for (const header of view.table.tHead.querySelectorAll('[aria-sort]')) {
      for (const direction of ['ascending', 'descending']) {
        header.querySelector('button').click();
        sorts++;
        if (header.getAttribute('aria-sort') !== direction || !inOrder(view, header)) wrong.push(`${view.scene.name}: ${header.dataset.key} ${direction}`);
      }
    }
  }
  return {wrong, sorts};
}

/** Two frames later. Chromium's virtual time outruns its frames, so that timers by their number are the limit, not time. */
async function nextFrame() {
  let come = false;
  requestAnimationFrame(() => requestAnimationFrame(() => { come = true; }));
  for (let turn = 0; turn < 10000 && !come; turn++) await new Promise((resolve) => setTimeout(resolve, 1));
}

/** Clicks a point of the plot, which charts answer with the next frame: whether its variant is selected, and details show. */
async function tryPoint(view) {
  const point = pointsDrawn(view)[0];
  if (!point) return false;
  const box = view.plotCanvas.getBoundingClientRect();
  view.plotCanvas.dispatchEvent(new MouseEvent('click', {bubbles: true, clientX: box.left + point.x, clientY: box.top + point.y}));
  await nextFrame();
  const near = pointsDrawn(view).filter((other) => Math.hypot(other.x - point.x, other.y - point.y) < 1).map((other) => other.$context.raw.variant);
  return near.includes(view.selected) && !view.tip.hidden && view.tip.textContent.includes(view.selected.label);
}

const inScenes = (list) => JSON.stringify(Object.fromEntries(views.map((view) => [view.scene.name, list(view).map((variant) => variant.id)])));

async function selfTest() {
  const players = views.flatMap((view) => view.scene.variants.map((variant) => playerOf(view, variant))).filter(Boolean);
  const canvases = [...document.querySelectorAll('main canvas')].filter((canvas) => canvas.clientHeight > 0 && hasPixels(canvas)).length;
  const drawn = views.flatMap(pointsDrawn).length, front = views.flatMap(frontDrawn).length;
  const said = {
    scenes: views.length, variants: views.reduce((sum, view) => sum + view.scene.variants.length, 0), plotted: drawn, front, canvases,
    'plotted-ids': inScenes((view) => pointsDrawn(view).map((point) => point.$context.raw.variant)),
    'front-ids': inScenes((view) => frontDrawn(view).map((point) => point.variant)),
    rows: document.querySelectorAll('main tbody tr').length,
  };
  const {wrong, sorts} = trySorts();
  Object.assign(said, {sorted: wrong.join('; ') || 'ok', sorts, clicks: 0});
  for (const view of views) said.clicks += await tryPoint(view);
  said.players = (await Promise.all(players.map(loads))).filter(Boolean).length;
  Object.assign(said, {errors: failures.join('; '), selftest: 'done'});
  for (const [name, value] of Object.entries(said)) document.documentElement.setAttribute('data-' + name, value);
}

// ---- Start ----

try {
  show(read());
  if (location.hash === '#selftest') selfTest();
} catch (error) {
  if (!(error instanceof Damage)) throw error;
  const sentence = `This report cannot be shown: ${error.message}.`;
  document.getElementById('scenes').replaceChildren(make('p', {class: 'failure', role: 'alert'}, sentence));
  document.documentElement.dataset.selftest = 'failed';
  document.documentElement.dataset.errors = sentence;
}
})();
