// Which runs of a page are shown: those that its address asks for, "#runs=exact,as_told", by their ids.
// A page of many runs, such as that of a report, would take long to unpack, so it shows two at a time.
import {make} from '../text/dom.js';

const kMost = 4;  // runs that are shown where the address asks for none

function parametersOf(hash) {
  return new URLSearchParams(hash.replace(/^#/, ''));
}

/// True for a page of many scenes, each with a run, of which one is shown at a time. A few are taken for variants, as
/// somebody may have edited a copy of a scene and named it otherwise.
export function isGallery(manifest) {
  return manifest.runs.length > kMost && new Set(manifest.runs.map((run) => run.name)).size === manifest.runs.length;
}

/// The manifest's runs that are to be shown, in the order of the address.
export function chosenRuns(manifest, hash = location.hash) {
  const wanted = (parametersOf(hash).get('runs') ?? '').split(',');
  const chosen = wanted.map((id) => manifest.runs.find((run) => run.id === id)).filter(Boolean);
  if (chosen.length) return [...new Set(chosen)];
  if (isGallery(manifest)) return manifest.runs.slice(0, 1);
  return manifest.runs.length > kMost ? manifest.runs.slice(0, 2) : manifest.runs;
}

/// The time at which the address has the page begin, in s.
export function chosenTime(hash = location.hash) {
  const time = Number(parametersOf(hash).get('t'));
  return Number.isFinite(time) && time > 0 ? time : 0;
}

/// A list of the runs that are not shown, to put one in the place of the run that is heard; null if all are.
export function otherRuns(manifest, runs, player) {
  const shown = runs.map((run) => run.id);
  const others = manifest.runs.filter((run) => !shown.includes(run.id));
  if (!others.length) return null;
  const scenes = isGallery(manifest), words = scenes ? 'Another scene' : 'Another run in the place of this one';
  const list = make('select', {id: 'other-runs', 'aria-label': words, title: words},
      make('option', {value: ''}, scenes ? 'Scenes…' : 'Other…'), ...others.map((run) => make('option', {value: run.id}, run.label.replaceAll('_', ' '))));
  list.addEventListener('change', () => {
    if (!list.value) return;
    const ids = shown.map((id, index) => (index === player.runIndex ? list.value : id));
    location.hash = scenes ? `runs=${list.value}` : `runs=${ids.join(',')}&t=${player.time.toFixed(4)}`;
    location.reload();
  });
  return list;
}
