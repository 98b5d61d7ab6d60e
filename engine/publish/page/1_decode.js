// SPDX-License-Identifier: MIT
// The parts of the payload, as the page arrives; each leaves the document once it is read.
async function* parts(progress) {
  for (let read = 0; read < scene.parts; ++read) {
    let part;
    while (!(part = document.getElementById("part" + read)) || !(part.nextSibling || document.readyState !== "loading")) {
      if (document.readyState !== "loading") throw Error(`the page is not whole: part ${read + 1} of ${scene.parts} is missing`);
      await new Promise(done => setTimeout(done, 20));
    }
    const text = part.textContent.trim();
    part.remove();
    progress((read + 1) / scene.parts);
    yield fromBase64(text);
    await nextFrame();
  }
}

async function* inflated(progress) {
  if (typeof DecompressionStream === "undefined") throw Error("this browser cannot unpack data (DecompressionStream)");
  const stream = new DecompressionStream("gzip"), writer = stream.writable.getWriter(), reader = stream.readable.getReader();
  const writing = (async () => {
    for await (const part of parts(progress)) await writer.write(part);
    await writer.close();
  })();
  let broken;
  writing.catch(error => { broken = error; writer.abort(error).catch(() => {}); });
  try {
    for (let block; !(block = await reader.read()).done;) yield block.value;
  } catch (error) { throw broken || error; }
  await writing;
}

// The words of a column of values, from its bytes: all low bytes, then the next, ...
function unpack(bytes, c, integers, {layers, position}) {
  const n = scene.count, into = layers[c.word >> 2];
  integers.fill(0);
  for (let b = 0, at = 0; b < c.bytes; ++b) for (let i = 0; i < n; ++i) integers[i] |= bytes[at++] << (8 * b);
  if (c.difference) for (let i = 1; i < n; ++i) integers[i] = integers[i - 1] + (integers[i] >>> 1 ^ -(integers[i] & 1));
  const floats = new Float32Array(integers.buffer), exact = c.low === undefined;
  if (c.attribute === "position") {
    if (!exact) for (let i = 0; i < n; ++i) floats[i] = c.low + c.step * integers[i];
    for (let i = 0; i < n; ++i) position[3 * i + c.component] = floats[i];
  } else if (exact && c.attribute === "opacity_logit") {
    for (let i = 0; i < n; ++i) floats[i] = 1 / (1 + Math.exp(-Math.min(Math.max(floats[i], -scene.logitLimit), scene.logitLimit)));
  } else if (exact && c.bits === 16) {
    for (let i = 0; i < n; ++i) integers[i] = half(floats[i]);
  }
  for (let i = 0, at = c.word & 3; i < n; ++i, at += 4) into[at] |= integers[i] << c.shift;
}

// The splats as the shaders read them, column by column as they arrive; no more of the payload is held.
async function decode(progress) {
  const n = scene.count, splats = {layers: Array.from({length: scene.layers}, () => new Uint32Array(4 * n)), position: new Float32Array(3 * n)};
  const integers = new Uint32Array(n), room = new Uint8Array(n * Math.max(...scene.columns.map(c => c.bytes)));
  let which = 0, at = 0;
  for await (const block of inflated(progress))
    for (let from = 0; from < block.length;) {
      const c = scene.columns[which], size = n * c?.bytes, part = block.subarray(from, from + size - at);
      if (!c) throw Error("the page is not whole: it holds more than its splats");
      room.set(part, at);
      from += part.length;
      at += part.length;
      if (at < size) continue;
      unpack(room, c, integers, splats);
      ++which;
      at = 0;
    }
  if (which < scene.columns.length) throw Error("the page is not whole: splats are missing");
  if (scene.exact) normalise(splats.layers);
  return splats;
}

// Quaternions of any length.
function normalise(layers) {
  const places = [0, 1, 2, 3].map(k => scene.columns.find(c => c.attribute === "rotation" && c.component === k).word);
  const floats = layers.map(layer => new Float32Array(layer.buffer));
  for (let i = 0; i < scene.count; ++i) {
    const q = places.map(word => floats[word >> 2][4 * i + (word & 3)]), most = Math.max(...q.map(Math.abs));
    const norm = Math.hypot(...q.map(x => x / most)) * most;
    places.forEach((word, k) => { floats[word >> 2][4 * i + (word & 3)] = q[k] / norm; });
  }
}

async function openSplats(viewer) {
  viewer.load(await decode(share => {
    element("bar").style.width = 100 * share + "%";
    element("loaded").textContent = `${Math.round(scene.megabytes * share * 10) / 10} of ${scene.megabytes} MB`;
  }));
}
