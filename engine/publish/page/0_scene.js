// SPDX-License-Identifier: MIT
const scene = JSON.parse(document.getElementById("scene").textContent);
const element = id => document.getElementById(id);
const nextFrame = () => new Promise(done => setTimeout(done, 0));

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
