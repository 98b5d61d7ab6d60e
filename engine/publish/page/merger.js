// SPDX-License-Identifier: MIT
// For pictures in motion on slow devices: splats that lie side by side on a Morton curve become one that keeps opacity
// times area, mean, second moment and harmonics, as engine/scene/merge_splats.h has it of better chosen ones.
const together = 4;  // splats at most

function spread(v) {
  v = (v | v << 16) & 0x030000ff;
  v = (v | v << 8) & 0x0300f00f;
  v = (v | v << 4) & 0x030c30c3;
  return (v | v << 2) & 0x09249249;
}

function mortonOrder(position, middle, radius) {
  const n = position.length / 4, code = new Uint32Array(n), order = new Uint32Array(n);
  const cell = (i, k) => Math.max(0, Math.min(1023, 512 + 128 * (position[4 * i + k] - middle[k]) / radius));
  for (let i = 0; i < n; ++i) {
    code[i] = spread(cell(i, 0)) | spread(cell(i, 1)) << 1 | spread(cell(i, 2)) << 2;
    order[i] = i;
  }
  return order.sort((a, b) => code[a] - code[b] || a - b);
}

// Values of splats in words (page_splats.h): how each attribute is read and written, value by value.
const bits = new Uint32Array(1), float = new Float32Array(bits.buffer);

function fields(layers, columns) {
  const found = {};
  for (const c of columns) {
    const words = layers[c.word >> 2], lane = c.word & 3, mask = c.bits < 32 ? 2 ** c.bits - 1 : 0xffffffff, whole = c.low === undefined && c.bits === 32 || c.attribute === "position";
    (found[c.attribute] ??= [])[c.component] = whole ? {
      get: i => { bits[0] = words[4 * i + lane]; return float[0]; },
      set: (i, x) => { float[0] = x; words[4 * i + lane] = bits[0]; },
    } : c.low === undefined ? {  // halves
      get: i => fromHalf(words[4 * i + lane] >>> c.shift & mask),
      set: (i, x) => { words[4 * i + lane] |= half(x) << c.shift; },
    } : {
      get: i => c.low + c.step * (words[4 * i + lane] >>> c.shift & mask),
      set: (i, x) => { words[4 * i + lane] |= Math.max(0, Math.min(mask, Math.round((x - c.low) / c.step))) << c.shift; },
    };
  }
  return found;
}

function fromHalf(h) {
  const power = h >> 10 & 31, size = power ? (1024 + (h & 1023)) * 2 ** (power - 25) : (h & 1023) * 2 ** -24;
  return h & 0x8000 ? -size : size;
}

function turnOf(rotation, exact, i) {
  const q = rotation.map(field => field.get(i));
  if (exact) return q;
  const others = q.slice(0, 3);
  others.splice(q[3], 0, Math.sqrt(Math.max(0, 1 - q[0] ** 2 - q[1] ** 2 - q[2] ** 2)));
  return others;
}

function setTurn(rotation, exact, i, q) {
  if (exact) return rotation.forEach((field, k) => field.set(i, q[k]));
  const largest = q.reduce((best, x, k) => Math.abs(x) > Math.abs(q[best]) ? k : best, 0), sign = q[largest] < 0 ? -1 : 1;
  [...q.filter((_, k) => k !== largest).map(x => sign * x), largest].forEach((x, k) => rotation[k].set(i, x));
}

// Columns of the rotation of a unit quaternion w x y z.
const columnsOf = (w, x, y, z) => [
  [1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)],
  [2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)],
  [2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)]];

// Root mean square over all directions, but for a factor.
const areaOf = (a, b, c) => Math.sqrt(a * b + b * c + c * a);  // of variances

// Of a symmetric xx xy xz yy yz zz: variances and the columns of a rotation, by Jacobi's method.
function axesOf([xx, xy, xz, yy, yz, zz]) {
  const m = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]], v = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];
  for (let round = 0; round < 5; ++round)
    for (const [p, q] of [[0, 1], [0, 2], [1, 2]]) {
      if (m[p][q] === 0) continue;
      const theta = (m[q][q] - m[p][p]) / (2 * m[p][q]);
      const t = Math.sign(theta || 1) / (Math.abs(theta) + Math.sqrt(theta * theta + 1)), c = 1 / Math.sqrt(t * t + 1), s = t * c;
      for (let k = 0; k < 3; ++k) [m[k][p], m[k][q]] = [c * m[k][p] - s * m[k][q], s * m[k][p] + c * m[k][q]];
      for (let k = 0; k < 3; ++k) [m[p][k], m[q][k]] = [c * m[p][k] - s * m[q][k], s * m[p][k] + c * m[q][k]];
      for (let k = 0; k < 3; ++k) [v[p][k], v[q][k]] = [c * v[p][k] - s * v[q][k], s * v[p][k] + c * v[q][k]];
    }
  return {variances: [m[0][0], m[1][1], m[2][2]], columns: v};
}

// Shepperd's method: from the largest of the four.
function quaternionOf([[a, b, c], [d, e, f], [g, h, k]]) {
  const squares = [1 + a + e + k, 1 + a - e - k, 1 - a + e - k, 1 - a - e + k], most = squares.indexOf(Math.max(...squares));
  const s = 2 * Math.sqrt(squares[most]);
  const q = [
    [s / 4, (f - h) / s, (g - c) / s, (b - d) / s], [(f - h) / s, s / 4, (b + d) / s, (g + c) / s],
    [(g - c) / s, (b + d) / s, s / 4, (f + h) / s], [(b - d) / s, (g + c) / s, (f + h) / s, s / 4]][most];
  const norm = Math.hypot(...q);
  return q.map(x => x / norm);
}

function merged({layers}, {columns, exact, middle, radius, secondMoment}) {
  const from = fields(layers, columns), n = layers[0].length / 4, order = mortonOrder(new Float32Array(layers[0].buffer), middle, radius);
  const place = (i, k) => from.position[k].get(i), variance = (i, k) => Math.exp(2 * Math.max(-40, Math.min(40, from.log_scale[k].get(i))));
  const far = (i, j) => {
    const reach = 16 * Math.max(variance(i, 0), variance(i, 1), variance(i, 2), variance(j, 0), variance(j, 1), variance(j, 2));
    let d = 0;
    for (let k = 0; k < 3; ++k) d += (place(i, k) - place(j, k)) ** 2;
    return d > Math.max(reach, (radius / 256) ** 2);
  };
  const starts = [];
  for (let k = 0, first = 0; k < n; ++k)
    if (k === 0 || k - first === together || far(order[first], order[k])) starts.push(first = k);
  const count = starts.length, out = {layers: layers.map(() => new Uint32Array(4 * count)), position: new Float32Array(3 * count)}, to = fields(out.layers, columns);
  const colours = [...from.sh_dc, ...from.sh_rest || []], mixed = [...to.sh_dc, ...to.sh_rest || []];
  starts.push(n);
  for (let g = 0; g < count; ++g) {
    const group = order.subarray(starts[g], starts[g + 1]);
    const weights = Array.from(group, i => from.opacity_logit[0].get(i) * areaOf(variance(i, 0), variance(i, 1), variance(i, 2)) || 1e-30);
    const all = weights.reduce((a, b) => a + b), mean = [0, 0, 0], moment = [0, 0, 0, 0, 0, 0];
    group.forEach((i, j) => { for (let k = 0; k < 3; ++k) mean[k] += weights[j] / all * place(i, k); });
    colours.forEach((field, k) => mixed[k].set(g, weights.reduce((sum, w, j) => sum + w / all * field.get(group[j]), 0)));
    group.forEach((i, j) => {
      const w = weights[j] / all, d = mean.map((x, k) => place(i, k) - x), axes = columnsOf(...turnOf(from.rotation, exact, i));
      for (let p = 0, at = 0; p < 3; ++p)
        for (let q = p; q < 3; ++q, ++at) {
          moment[at] += w * d[p] * d[q] / secondMoment;
          for (let k = 0; k < 3; ++k) moment[at] += w * variance(i, k) * axes[k][p] * axes[k][q];
        }
    });
    const {variances, columns: axes} = axesOf(moment), [a, b, c] = variances.map(x => Math.max(x, 1e-30));
    // More than opaque: larger, as splat_moments.h has it. A shape starts again.
    const opacity = all / areaOf(a, b, c), larger = Math.max(1, opacity / 0.99) ** 0.4;
    mean.forEach((x, k) => to.position[k].set(g, out.position[3 * g + k] = x));
    to.opacity_logit[0].set(g, Math.min(opacity, 0.99));
    [a, b, c].forEach((x, k) => to.log_scale[k].set(g, 0.5 * Math.log(x * larger)));
    setTurn(to.rotation, exact, g, quaternionOf(axes));
    to.shape?.[0].set(g, 0);
  }
  return out;
}
