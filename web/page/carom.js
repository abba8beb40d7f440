// window.carom: what the page offers to scripts and tests (docs/view.md).
import {liveOf} from './live/carom_live.js';
import {Film} from './film/film.js';

/// `opened` is a promise of {view, offline, manifest}; until it is kept only `ready` and `version` tell anything.
export function caromOf(opened) {
  let page = null, film = null;
  const ready = opened.then((parts) => {
    page = parts;
    return new Promise((resolve) => requestAnimationFrame(() => resolve()));
  });
  ready.catch(() => {});   // the page itself says what failed
  const view = () => {
    if (!page) throw new Error('wait for carom.ready');
    return page.view;
  };
  return {
    ready,
    live: liveOf(view),
    get version() { return page?.manifest.version ?? ''; },
    get time() {
      view().player.tick(performance.now());   // pictures may come slower than scripts ask
      return view().player.time;
    },
    get duration() { return view().player.duration; },
    get playing() { return view().player.playing; },
    get late() { return view().sound.late; },
    get sounds() { return view().sound.renders && view().player.run.hasSound; },
    get runs() { return view().player.runs.map(({id, label}) => ({id, label})); },
    get run() { return view().player.runIndex; },
    set run(index) { view().player.setRun(index); },
    get speed() { return view().player.speed; },
    set speed(speed) { view().player.setSpeed(speed); },
    /// ms between the latest seek and its first sound, as the worklet tells; null before any.
    get seekDelay() { return view().sound.seekDelay; },
    seek(time) { view().player.seek(time); },
    play() { return view().player.play(); },
    pause() { view().player.pause(); },
    setEar(position, orientation = [1, 0, 0, 0]) { view().setEar([...position, ...orientation]); },
    setFormat(format) { view().ear.setFormat(format); },
    events() { return view().player.run.events.map(({rows, ...event}) => ({...event})); },
    select(event) { view().select(view().player.run.events[typeof event === 'number' ? event : event.index]); },
    project(place) { return view().stage.project(place).slice(0, 2); },
    pose(body) { return [...view().player.run.tracks.pose(body, view().player.time, new Array(7))]; },
    pick(x, y) {
      if (view().stale) view().drawNow();   // bodies are where the latest picture has them
      return view().stage.pick(x, y);
    },
    colour(body) { return view().stage.colourOf(body); },
    screenshot() { return view().screenshot(); },
    /// Pictures one by one; from its first use on, the page's own picture stands.
    get film() { return film ??= new Film(view()); },
    async renderOffline(from, seconds, {listener = -1, run} = {}) {
      await ready;
      const {player, ear} = view();
      const which = player.runs[run ?? player.runIndex];
      const hear = {...ear.order(which), ...(listener >= 0 ? {follow: listener} : {}), kinds: 7, silent: null};
      return page.offline.render(which, from, seconds, hear);
    },
  };
}
