// SPDX-License-Identifier: MIT
// The worker: splats by the depth of their centres, front to back, equal depths by their number. Another one merges.
const levels = [];  // of splats: their positions, and room to sort. A streamed scene has one, in which chunks come and go
const counts = new Uint32Array(3 << 11);

function sort({position, keys, other, order, otherOrder}, ranges, row, centre, near) {
  const depth = new Float32Array(keys.buffer);
  const [a, b, c] = row, [x, y, z] = centre;
  let visible = 0;
  counts.fill(0);
  for (let r = 0, i = 0, end = 0; r < ranges.length || i < end; ++i) {
    if (i >= end) {
      [i, end] = [ranges[r], ranges[r] + ranges[r + 1]];
      r += 2;
      if (i >= end) continue;
    }
    const d = a * (position[3 * i] - x) + b * (position[3 * i + 1] - y) + c * (position[3 * i + 2] - z);
    if (!(d > near)) continue;
    depth[visible] = d;
    const bits = keys[visible];
    order[visible++] = i;
    ++counts[bits & 2047];
    ++counts[2048 + ((bits >>> 11) & 2047)];
    ++counts[4096 + (bits >>> 22)];
  }
  let from = keys, to = other, list = order, next = otherOrder;
  for (let pass = 0; pass < 3; ++pass) {
    const first = pass << 11, shift = 11 * pass;
    for (let k = first, sum = 0; k < first + 2048; ++k) {
      const count = counts[k];
      counts[k] = sum;
      sum += count;
    }
    for (let i = 0; i < visible; ++i) {
      const at = counts[first + ((from[i] >>> shift) & 2047)]++;
      to[at] = from[i];
      next[at] = list[i];
    }
    [from, to, list, next] = [to, from, next, list];
  }
  return list.slice(0, visible);
}

onmessage = ({data}) => {
  if (data.merge) {
    let splats = data.merge;
    data.merge = null;
    for (let level = 1; level <= data.levels; ++level) {
      splats = merged(splats, data);
      postMessage({level, splats}, level === data.levels ? [splats.position, ...splats.layers].map(a => a.buffer) : []);
    }
  } else if (data.at !== undefined) {
    levels[data.level].position.set(data.position, 3 * data.at);
  } else if (data.position || data.room) {
    const position = data.position || new Float32Array(3 * data.room), n = position.length / 3, room = () => new Uint32Array(n);
    levels[data.level] = {position, keys: room(), other: room(), order: room(), otherOrder: room()};
  } else {
    const level = levels[data.level], order = sort(level, data.ranges || [0, level.keys.length], data.row, data.centre, data.near);
    postMessage({id: data.id, order}, [order.buffer]);
  }
};
