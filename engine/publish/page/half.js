// SPDX-License-Identifier: MIT
// The bits of the nearest number of 16 bits, ties to even.
function half(x) {
  const sign = x < 0 || Object.is(x, -0) ? 0x8000 : 0, size = Math.min(Math.abs(x), 65504);
  if (!(size > 0)) return sign;
  const power = Math.max(-14, Math.floor(Math.log2(size))), steps = size * 2 ** (10 - power), down = Math.floor(steps), rest = steps - down;
  return sign | ((power + 14) << 10) + down + (rest > 0.5 || rest === 0.5 && down & 1 ? 1 : 0);
}
