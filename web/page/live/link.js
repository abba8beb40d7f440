// A scene inside of an address: "#scene=" and base64url of its JSON, deflated.

export const kLong = 30000;   // characters: not every program takes an address that is longer

async function piped(bytes, stream) {
  return new Uint8Array(await new Response(new Blob([bytes]).stream().pipeThrough(stream)).arrayBuffer());
}
function base64url(bytes) {
  let text = '';
  for (let at = 0; at < bytes.length; at += 8192) text += String.fromCharCode(...bytes.subarray(at, at + 8192));
  return btoa(text).replaceAll('+', '-').replaceAll('/', '_').replace(/=+$/, '');
}
function bytesOf(base64) {
  return Uint8Array.from(atob(base64.replaceAll('-', '+').replaceAll('_', '/')), (letter) => letter.charCodeAt(0));
}

export async function linkOf(scene, address = location.href) {
  const packed = await piped(new TextEncoder().encode(JSON.stringify(scene)), new CompressionStream('deflate-raw'));
  return `${address.replace(/#.*$/, '')}#scene=${base64url(packed)}`;
}

/// The text of the scene in an address; null if there is none.
export async function linkedScene(hash = location.hash) {
  const packed = new URLSearchParams(hash.replace(/^#/, '')).get('scene');
  if (!packed) return null;
  try {
    return new TextDecoder().decode(await piped(bytesOf(packed), new DecompressionStream('deflate-raw')));
  } catch {
    throw new Error('The scene in this address cannot be read: the address may have been cut off.');
  }
}
