// window.carom.live: the live run for scripts and tests (docs/view.md).

/// `view` gives the page's View, or throws until the page is ready.
export function liveOf(view) {
  const desk = () => view().live;
  const live = () => {
    const {live: run} = desk();
    if (!run.run) throw new Error('start the live run first');
    return run;
  };
  return {
    start: () => desk().start(),
    get running() { return desk().live.running; },
    get head() { return live().head; },
    get past() { return live().past; },
    get slow() { return live().slow; },
    get size() { return live().growth.size; },
    get most() { return live().most; },
    set most(bytes) { live().most = bytes; },
    get late() { return view().sound.late; },
    get settings() { return live().settings; },
    middle: (body) => desk().middleOf(body),
    throw: (body) => live().throw(body),
    push: (body, velocity) => live().push(body, velocity),
    pull: (body, place, grip) => live().pull(body, place, grip),
    release: () => live().release(),
    set: (settings) => live().set(settings),
    rewind: (time) => live().rewind(time),
    takeBack: () => live().takeBack(),
    goOn: () => live().goOn(),
    advance: (seconds) => live().advance(seconds),
    sceneJson: () => live().sceneJson(),
    link: () => live().link(),
    runFile: () => live().runFile(),
  };
}
