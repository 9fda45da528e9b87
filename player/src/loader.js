// Opens a page that was made with --compress: unpacks the scene and the player, and starts the player.

async function unpacked(id) {
  const bytes = Uint8Array.from(atob(document.getElementById(id).textContent), (character) => character.charCodeAt(0));
  return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream('gzip'))).text();
}

async function open() {
  const [data, program] = await Promise.all(['packed-scene', 'packed-player'].map(unpacked));
  const scene = Object.assign(document.createElement('script'), { type: 'application/json', id: 'scene', textContent: data });
  const player = Object.assign(document.createElement('script'), { textContent: program });
  document.body.append(scene, player);
}

open().catch((error) => {
  document.body.append(`This browser cannot open a compressed page (browsers since 2023 can): ${error.message}. Make it without --compress.`);
});
