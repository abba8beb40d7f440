// Pictures of a run one by one, each at a time that is asked for, without the page about them: for `carom video`, and for
// whoever wants them (docs/view.md). The same questions in the same order give the same pictures.
import {drawOverlay} from './overlay.js';

const kQuality = 0.95;   // of the JPEG: what H.264 and VP9 lose afterwards is more
const kSteady = {mode: 'camera', pose: [0, 0, 0, 1, 0, 0, 0], listener: -1};

export class Film {
  #ear = kSteady;

  constructor(view) {
    this.view = view;
    this.canvas = document.createElement('canvas');
  }

  /// Takes the stage from the page, for good: `width` and `height` in pixels; `listener` is the one that is shown, by its
  /// index, or -1. Returns the first view of the page in that size: {pose: x y z, w x y z, fov: degrees along the shorter
  /// side, duration}.
  begin({width, height, listener = -1}) {
    const {stage, player} = this.view;
    if (player.playing) player.pause();
    this.view.held = true;
    Object.assign(this.canvas, {width, height});
    // The picture is read back for every frame, so it stays in memory.
    this.pen = this.canvas.getContext('2d', {alpha: false, willReadFrequently: true});
    this.#ear = listener >= 0 ? {...kSteady, mode: 'listener', listener} : kSteady;
    stage.hold(width, height, listener);
    return {pose: stage.cameraPose(), fov: stage.fieldOfView, duration: player.run.duration};
  }
  get #title() {
    const title = this.view.manifest.title.replaceAll('_', ' ');
    return title.charAt(0).toUpperCase() + title.slice(1);
  }

  /// The picture at a time of the run, as JPEG in base64. `pose` and `fov` are those of the camera; `speed` is that of the
  /// run over the watch; `watch` s have passed of the film. `captions` and a `meter`, {top, range} in dB, are drawn over it,
  /// with the meter's `levels`, {now, peak} in dB for each channel.
  frame(time, {pose, fov, speed = 1, watch = 0, captions = false, meter = null, levels = []}) {
    const {stage, player} = this.view, {width, height} = this.canvas;
    stage.place(pose, fov);
    stage.draw(time, speed, this.#ear, true);
    this.pen.drawImage(stage.canvas, 0, 0, width, height);
    drawOverlay(this.pen, {captions, meter, levels, dark: stage.theme.dark, run: player.run, title: this.#title, time, speed, watch});
    const address = this.canvas.toDataURL('image/jpeg', kQuality);
    return address.slice(address.indexOf(',') + 1);
  }
}
