// Unpacks the page's script, which is packed like everything else in it, and runs it. Until then window.carom has only `ready`.
globalThis.carom = {
  version: '',
  ready: (async () => {
    const text = atob(document.getElementById('carom-script').textContent);
    const bytes = Uint8Array.from(text, (letter) => letter.charCodeAt(0));
    const script = document.createElement('script');
    script.textContent = await new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream('gzip'))).text();
    document.body.append(script);   // runs at once, and puts the whole of window.carom in place of this
    return globalThis.carom.ready;
  })(),
};
