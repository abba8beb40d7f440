// What one takes along from a live run: its run as a file, its scene as JSON, and a link that holds the scene.
import {kLong} from './link.js';
import {byId, make} from '../text/dom.js';

const kFreed = 30000;   // ms after which a file's bytes are let go

function fileName(title) {
  return `${title.trim().replace(/[^\w.-]+/g, '_') || 'scene'}_live.carom`;
}

export class Keep {
  constructor(desk) {
    this.desk = desk;
  }

  saveRun() {
    const {desk} = this;
    return desk.try(() => {
      const address = URL.createObjectURL(new Blob([desk.live.runFile()], {type: 'application/octet-stream'}));
      const anchor = make('a', {href: address, download: fileName(byId('title').textContent)});
      anchor.click();
      setTimeout(() => URL.revokeObjectURL(address), kFreed);
      desk.bar.say('The run is saved. "carom replay FILE" and "carom view FILE" take it.');
    });
  }
  copyScene() {
    return this.desk.try(() => this.#copy(JSON.stringify(this.desk.live.sceneJson(), null, 2), 'The scene as it is now'));
  }
  async copyLink() {
    try {
      const link = await this.desk.live.link();
      const long = link.length > kLong ? ` It has ${Math.round(link.length / 1000)} kB, which not every program takes.` : '';
      await this.#copy(link, 'The link to the scene as it is now', long);
    } catch (error) {
      this.desk.bar.say(error.message);
    }
  }
  /// Pages from a disk may not reach the clipboard; then the text is there to be copied by hand.
  async #copy(text, what, more = '') {
    try {
      await navigator.clipboard.writeText(text);
      this.desk.bar.say(`${what} is copied.${more}`);
    } catch {
      this.desk.sheet.showText(text, `${what}, to be copied from here:${more}`);
    }
  }
}
