// SPDX-License-Identifier: MIT
const digits = new Uint8Array(128);
[..."ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/"].forEach((c, i) => { digits[c.charCodeAt(0)] = i; });

function fromBase64(text) {
  const length = text.length, padding = text.endsWith("==") ? 2 : text.endsWith("=") ? 1 : 0;
  const bytes = new Uint8Array(length / 4 * 3 - padding);
  for (let i = 0, o = 0; i < length; i += 4) {
    const bits = digits[text.charCodeAt(i)] << 18 | digits[text.charCodeAt(i + 1)] << 12 |
                 digits[text.charCodeAt(i + 2)] << 6 | digits[text.charCodeAt(i + 3)];
    bytes[o++] = bits >> 16;
    bytes[o++] = bits >> 8;
    bytes[o++] = bits;
  }
  return bytes;
}

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

async function inflated(progress) {
  if (typeof DecompressionStream === "undefined") throw Error("this browser cannot unpack data (DecompressionStream)");
  const stream = new DecompressionStream("gzip"), writer = stream.writable.getWriter();
  const bytes = new Uint8Array(scene.bytes);
  let at = 0;
  const reading = (async () => {
    const reader = stream.readable.getReader();
    for (let block; !(block = await reader.read()).done; at += block.value.length) bytes.set(block.value, at);
  })();
  for await (const part of parts(progress)) await Promise.race([writer.write(part), reading]);
  await Promise.all([writer.close(), reading]);
  if (at !== bytes.length) throw Error("the page is not whole: splats are missing");
  return bytes;
}

// A column of values from its bytes: all low bytes, then the next, ...
function column(bytes, at, c) {
  const n = scene.count, integers = new Uint32Array(n);
  for (let b = 0; b < c.bytes; ++b, at += n)
    for (let i = 0; i < n; ++i) integers[i] |= bytes[at + i] << (8 * b);
  if (c.difference) for (let i = 1; i < n; ++i) integers[i] = integers[i - 1] + (integers[i] >>> 1 ^ -(integers[i] & 1));
  if (c.exact) return new Float32Array(integers.buffer);
  const values = new Float32Array(n);
  for (let i = 0; i < n; ++i) values[i] = c.low + c.step * integers[i];
  return values;
}

// The splats as the shaders read them, each array with `width` floats a splat.
async function decode(progress) {
  const bytes = await inflated(progress), n = scene.count;
  const splats = {position: new Float32Array(3 * n), place: new Float32Array(4 * n), turn: new Float32Array(4 * n), size: new Float32Array(4 * n), tint: new Float32Array(4 * n)};
  const terms = (scene.degree + 1) ** 2 - 1;
  splats.light = Array.from({length: terms}, () => new Float32Array(3 * n));
  const target = {
    position: k => [splats.place, 4, k], log_scale: k => [splats.size, 4, k], rotation: k => [splats.turn, 4, k],
    opacity_logit: () => [splats.place, 4, 3], sh_dc: k => [splats.tint, 4, k],
    sh_rest: k => [splats.light[Math.floor(k / 3)], 3, k % 3],
  };
  let at = 0;
  for (const c of scene.columns) {
    const values = column(bytes, at, c), [array, stride, offset] = target[c.attribute](c.component);
    at += n * c.bytes;
    for (let i = 0; i < n; ++i) array[stride * i + offset] = values[i];
    if (c.component % 8 === 0) await nextFrame();
  }
  finish(splats);
  return splats;
}

async function openSplats(viewer) {
  viewer.load(await decode(share => {
    element("bar").style.width = 100 * share + "%";
    element("loaded").textContent = `${Math.round(scene.megabytes * share * 10) / 10} of ${scene.megabytes} MB`;
  }));
}

function finish({place, position, turn}) {
  for (let i = 0; i < scene.count; ++i) {
    for (let k = 0; k < 3; ++k) position[3 * i + k] = place[4 * i + k];
    if (scene.exact) place[4 * i + 3] = 1 / (1 + Math.exp(-Math.min(Math.max(place[4 * i + 3], -scene.logitLimit), scene.logitLimit)));
    const q = turn.subarray(4 * i, 4 * i + 4);
    if (scene.exact) {
      const most = Math.max(Math.abs(q[0]), Math.abs(q[1]), Math.abs(q[2]), Math.abs(q[3]));
      const norm = Math.hypot(q[0] / most, q[1] / most, q[2] / most, q[3] / most) * most;
      for (let k = 0; k < 4; ++k) q[k] /= norm;
    } else {
      const largest = q[3], others = [q[0], q[1], q[2]];
      const whole = Math.sqrt(Math.max(0, 1 - others[0] ** 2 - others[1] ** 2 - others[2] ** 2));
      for (let k = 0, o = 0; k < 4; ++k) q[k] = k === largest ? whole : others[o++];
    }
  }
}
