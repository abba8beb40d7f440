// The page of `carom batch report`: histograms, players and outliers from the JSON element beside this script.
// Text from the data goes into text nodes only, never into markup.
(() => {
'use strict';

const batch = JSON.parse(document.getElementById('batch-data').textContent);
const rows = batch.rows;
const main = document.getElementById('batch');

/** An element with attributes and children. */
function make(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes))
    if (value !== null && value !== undefined) element.setAttribute(name, value);
  element.append(...children.flat(Infinity).filter((child) => child !== null && child !== undefined));
  return element;
}

const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue('--' + name).trim();
const digits = (value) => (Number.isInteger(value) ? String(value) : String(Number(value.toPrecision(3)))).replace(/^-/, '\u2212');
const shown = (value) => (typeof value === 'number' ? digits(value) : typeof value === 'string' ? value : JSON.stringify(value));
const level = (pascals) => (pascals > 0 ? 20 * Math.log10(pascals / 20e-6) : null);
const byName = (row) => row.index + (row.branch ? '.' + row.branch : '');

// ---- Histograms ----

const MOST_WORDS = 24;
const BINS = 24;

/** Counts of each word, the most frequent first where there are many. */
function wordBins(values) {
  const counts = new Map();
  for (const value of values) counts.set(shown(value), (counts.get(shown(value)) || 0) + 1);
  const all = [...counts].sort((a, b) => (a[0] < b[0] ? -1 : 1));
  if (all.length <= MOST_WORDS) return all.map(([label, count]) => ({label, count}));
  const most = all.sort((a, b) => b[1] - a[1]).slice(0, MOST_WORDS - 1);
  const rest = values.length - most.reduce((sum, [, count]) => sum + count, 0);
  return [...most.map(([label, count]) => ({label, count})), {label: `${all.length - most.length} others`, count: rest}];
}

/** Counts in bins of equal width, or of equal ratio. */
function numberBins(values, isLog) {
  const scale = isLog ? Math.log : (x) => x;
  const back = isLog ? Math.exp : (x) => x;
  let low = Infinity, high = -Infinity;
  for (const value of values) { low = Math.min(low, value); high = Math.max(high, value); }
  if (!(high > low)) return [{label: digits(low), count: values.length}];
  const from = scale(low), width = (scale(high) - from) / BINS;
  const bins = Array.from({length: BINS}, (unused, bin) => ({
    label: `${digits(back(from + bin * width))} to ${digits(back(from + (bin + 1) * width))}`, tick: digits(back(from + bin * width)), count: 0}));
  for (const value of values) bins[Math.min(BINS - 1, Math.floor((scale(value) - from) / width))].count++;
  return bins;
}

function histogram(title, unit, values, isLog = false) {
  const numbers = values.filter((value) => typeof value === 'number' && Number.isFinite(value));
  const isNumeric = numbers.length === values.length && new Set(values).size > 12;
  const bins = isNumeric ? numberBins(numbers, isLog && numbers.every((value) => value > 0)) : wordBins(values);
  const canvas = make('canvas', {role: 'img', 'aria-label': `${title}: ` + bins.map((bin) => `${bin.label}: ${bin.count}`).join('; ')});
  const figure = make('figure', {}, make('figcaption', {}, title, ' ', make('span', {}, unit)), make('div', {class: 'plot-box'}, canvas));
  const axis = {ticks: {color: colour('soft'), maxRotation: 0, autoSkipPadding: 8}, border: {color: colour('line')}};
  queueMicrotask(() => new Chart(canvas, {
    type: 'bar',
    data: {labels: bins.map((bin) => bin.tick || bin.label), datasets: [{data: bins.map((bin) => bin.count), backgroundColor: colour('wave'), categoryPercentage: 1, barPercentage: 0.92}]},
    options: {animation: false, responsive: true, maintainAspectRatio: false,
      scales: {x: {...axis, grid: {display: false}}, y: {...axis, grid: {color: colour('faint')}, beginAtZero: true, ticks: {...axis.ticks, precision: 0, maxTicksLimit: 5}}},
      plugins: {legend: {display: false}, tooltip: {displayColors: false, callbacks: {title: (items) => bins[items[0].dataIndex].label, label: (item) => `${item.raw} of ${values.length}`}}}},
  }));
  return figure;
}

// ---- Players ----

function card(row, why) {
  const facts = Object.entries(row.parameters).map(([name, value]) => [make('dt', {}, name), make('dd', {}, shown(value))]);
  const said = level(row.peak_pa);
  return make('article', {}, make('strong', {}, `Sample ${byName(row)}`), why ? ` \u2014 ${why}` : null,
    make('audio', {controls: '', preload: 'none', src: row.file}),
    make('dl', {}, facts, make('dt', {}, 'peak'), make('dd', {}, said === null ? 'silent' : `${digits(said)} dB SPL`),
      make('dt', {}, 'collisions'), make('dd', {}, digits(row.events / 2)), make('dt', {}, 'split'), make('dd', {}, row.split)));
}

/** Some rows, always the same ones. */
function some(count) {
  const picked = new Set();
  let state = 12345;
  while (picked.size < Math.min(count, rows.length)) {
    state = (state * 1103515245 + 12345) % 2147483648;
    picked.add(Math.floor((state / 2147483648) * rows.length));
  }
  return [...picked].sort((a, b) => a - b).map((at) => rows[at]);
}

function outliers() {
  const found = [];
  const take = (list, why) => list.slice(0, 3).forEach((row) => found.push(card(row, why)));
  take(rows.filter((row) => !(row.peak_pa > 0)), 'silent');
  take(rows.filter((row) => row.peak_pa > row.full_scale_pa), 'above full scale');
  take([...rows].sort((a, b) => b.peak_pa - a.peak_pa), 'loudest');
  take([...rows].sort((a, b) => b.duration_s - a.duration_s), 'longest');
  take([...rows].sort((a, b) => (b.wall_s || 0) - (a.wall_s || 0)), 'took longest');
  return found;
}

// ---- The page ----

function section(title, ...content) {
  main.append(make('section', {class: 'scene'}, make('h2', {}, title), ...content));
}

function table(heads, lines) {
  return make('div', {class: 'table-box'}, make('table', {},
    make('thead', {}, make('tr', {}, heads.map((head) => make('th', {}, head)))),
    make('tbody', {}, lines.map((line) => make('tr', {}, line.map((cell) => make('td', {}, cell)))))));
}

document.title = `${batch.name} \u2013 Carom batch`;
document.getElementById('name').textContent = batch.name;
document.getElementById('description').textContent = batch.description;
document.getElementById('machine').textContent =
  `${batch.whole} of ${batch.planned} sounds are whole, ${batch.failures.length} failed. ` +
  `${digits(batch.hours)} h of sound, ${digits(batch.factor)} times faster than real time on one processor. Made on ${batch.machines.join('; ')}.` +
  (rows.length < batch.whole ? ` Plots show every ${digits(batch.whole / rows.length)}th.` : '');

if (rows.length) {
  section('What was drawn', make('div', {class: 'plots'}, batch.parameters.map((parameter) =>
    histogram(parameter.name, parameter.kind, rows.map((row) => row.parameters[parameter.name]), parameter.kind === 'log_uniform'))));
  section('What came out', make('div', {class: 'plots'},
    histogram('peak', 'dB SPL', rows.map((row) => level(row.peak_pa)).filter((value) => value !== null)),
    histogram('duration', 's', rows.map((row) => row.duration_s)),
    histogram('collisions', '', rows.map((row) => row.events / 2)),
    histogram('attempts that were rejected', '', rows.map((row) => row.attempt)),
    histogram('time to make one', 'ms', rows.filter((row) => row.wall_s > 0).map((row) => 1e3 * row.wall_s), true),
    histogram('split', '', rows.map((row) => row.split))));
  section('A dozen, at random', make('div', {class: 'cards'}, some(12).map((row) => card(row))));
  section('Outliers', make('div', {class: 'cards'}, outliers()));
}
if (batch.failures.length) {
  const kinds = new Map();
  for (const failure of batch.failures) kinds.set(failure.failure, (kinds.get(failure.failure) || 0) + 1);
  section('Failures', table(['kind', 'number'], [...kinds].map(([kind, number]) => [kind, String(number)])),
    table(['sample', 'kind', 'why'], batch.failures.slice(0, 50).map((failure) => [byName(failure), failure.failure, failure.message])));
}
document.documentElement.dataset.ready = String(rows.length);
})();
