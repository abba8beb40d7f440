// The film that the page itself makes: what it shows and sounds, once from begin to end, as WebM by the browser's own recorder.
import {byId, make} from '../text/dom.js';

const kKinds = ['video/webm;codecs=vp9,opus', 'video/webm;codecs=vp8,opus', 'video/webm'];
const kPictures = 60;          // in a second, at most
const kBits = 12e6, kSoundBits = 192e3;   // in a second
const kRest = 400;             // ms after the end, within which the last sound and picture arrive

/// Why this browser makes no films; empty if it does.
export function noFilms(canvas) {
  if (!globalThis.MediaRecorder) return 'This browser has no MediaRecorder, which films need; carom video makes one without it.';
  if (!canvas.captureStream) return 'This browser cannot record a picture; carom video makes a film without it.';
  if (!kindOf()) return 'This browser records no WebM; carom video makes a film without it.';
  return '';
}
function kindOf() {
  return kKinds.find((kind) => MediaRecorder.isTypeSupported(kind));
}

export class Recorder {
  #recorder = null;
  #begins = false;
  #rolls = false;      // the stretch plays
  #ends = null;

  constructor(view) {
    this.view = view;
    byId('film').onclick = () => this.toggle();
    view.player.addEventListener('change', () => this.#watch());
  }
  get records() {
    return this.#recorder !== null;
  }
  toggle() {
    if (this.#begins) return undefined;
    if (this.records) return this.#end();
    this.#begins = true;
    return this.begin().finally(() => this.#begins = false);
  }

  /// Plays the loop, or else the stretch that the time line shows, once, and records it.
  async begin() {
    const {player, sound, stage, bar} = this.view, why = noFilms(stage.canvas);
    this.#offer(null);
    if (why) return this.#say(why);
    const range = player.loop ?? [bar.window.begin, bar.window.end];
    this.view.filming = true;   // from here on pictures keep their size
    await sound.start(player.run, await player.head());
    const pictures = stage.canvas.captureStream(kPictures);
    const tracks = [...pictures.getVideoTracks(), ...sound.recordedTracks()];
    const parts = [];
    const recorder = new MediaRecorder(new MediaStream(tracks), {mimeType: kindOf(), videoBitsPerSecond: kBits, audioBitsPerSecond: kSoundBits});
    recorder.ondataavailable = ({data}) => parts.push(data);
    recorder.onerror = ({error}) => this.#say(`The film has failed: ${error?.message ?? 'the browser does not say why'}.`);
    recorder.onstop = () => {
      pictures.getTracks().forEach((track) => track.stop());
      this.view.filming = false;
      this.view.touch();
      const film = new Blob(parts, {type: 'video/webm'});
      if (film.size) this.#offer(film, (range[1] - range[0]) / player.speed);
      else this.#say('Nothing has been recorded: this machine is too slow for it; carom video makes the film.');
    };
    this.#recorder = recorder;
    byId('film').setAttribute('aria-pressed', 'true');
    this.#say('Filming…');
    recorder.start(500);
    player.seek(range[0]);
    await this.#shown();   // the recorder has begun with a picture before the time goes on
    await player.once(range);
    this.#rolls = true;
  }
  #watch() {
    if (this.#rolls && !this.view.player.playing) this.#end();
  }
  /// Two pictures are drawn.
  async #shown() {
    for (let picture = 0; picture < 2; ++picture) {
      this.view.touch();
      await new Promise((resolve) => requestAnimationFrame(() => requestAnimationFrame(resolve)));
    }
  }
  /// The recorder gets a moment for what is still on its way.
  #end() {
    if (this.#ends) return;
    this.#rolls = false;
    this.view.touch();
    this.#ends = setTimeout(() => {
      const recorder = this.#recorder;
      this.#ends = this.#recorder = null;
      byId('film').setAttribute('aria-pressed', 'false');
      if (this.view.player.playing) this.view.player.pause();
      recorder.stop();
    }, kRest);
  }

  #say(words) {
    const card = byId('film-card');
    card.hidden = false;
    card.replaceChildren(make('span', {}, words), ...(this.records ? [] : [this.#close()]));
  }
  #close() {
    return make('button', {type: 'button', 'aria-label': 'Close', onclick: () => this.#offer(null)}, 'Close');
  }
  /// Shows the film as a file to save; null takes the last one away.
  #offer(blob, seconds = 0) {
    const card = byId('film-card');
    if (this.address) URL.revokeObjectURL(this.address);
    this.address = blob && URL.createObjectURL(blob);
    card.hidden = !blob;
    if (!blob) return;
    const name = `${this.view.manifest.title}.webm`;
    card.replaceChildren(make('span', {}, `${name}, ${seconds.toFixed(1)} s, ${(blob.size / 1e6).toFixed(1)} MB`),
                         make('a', {href: this.address, download: name, class: 'strong', id: 'film-file'}, 'Save'), this.#close());
    byId('film-file').focus();
  }
}
