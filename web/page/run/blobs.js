// What the page carries besides its code: elements with base64 of gzip, and the manifest.

function bytesOf(base64) {
  const clean = base64.trim();
  if (Uint8Array.fromBase64) return Uint8Array.fromBase64(clean);
  const text = atob(clean);
  const bytes = new Uint8Array(text.length);
  for (let at = 0; at < text.length; ++at) bytes[at] = text.charCodeAt(at);
  return bytes;
}

/// The unpacked bytes of an element, or null if the page does not have it. The element is emptied
/// if `once`, as a page of many megabytes would otherwise hold them twice.
export async function unpack(id, once = true) {
  const element = document.getElementById(id);
  const text = element?.textContent.trim();
  if (!text) return null;
  if (once) element.textContent = '';
  const packed = new Blob([bytesOf(text)]).stream().pipeThrough(new DecompressionStream('gzip'));
  return new Uint8Array(await new Response(packed).arrayBuffer());
}

/// Blobs by number, each unpacked at its first use.
export class Blobs {
  #known = new Map();
  get(number) {
    if (number === undefined || number === null) return Promise.resolve(null);
    if (!this.#known.has(number)) this.#known.set(number, unpack(`carom-blob-${number}`));
    return this.#known.get(number);
  }
  /// The bytes of several blobs, one after the other; null if there are none.
  async joined(numbers) {
    if (numbers === undefined || numbers === null) return null;
    const parts = await Promise.all([numbers].flat().map((number) => this.get(number)));
    if (parts.length === 1) return parts[0];
    const bytes = new Uint8Array(parts.reduce((size, part) => size + part.length, 0));
    parts.reduce((at, part) => {
      bytes.set(part, at);
      return at + part.length;
    }, 0);
    return bytes;
  }
}

/// The manifest; throws a sentence for the reader if the page has none, or one of another format.
export function readManifest() {
  const element = document.getElementById('carom-page');
  if (!element) throw new Error('There is no run in this page. "carom view SCENE" makes a page with one.');
  const manifest = JSON.parse(element.textContent);
  if (manifest.format !== 1) throw new Error(`This page reads format 1, and its runs have format ${manifest.format}.`);
  if (!manifest.runs?.length) throw new Error('There is no run in this page.');
  return manifest;
}
