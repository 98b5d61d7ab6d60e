// SPDX-License-Identifier: MIT
// Cameras: eye, axes (right, down, forward in the world) and the lens of a pinhole, in px of width x height.
const add = (a, b, s = 1) => [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const unit = a => { const l = Math.hypot(...a) || 1; return [a[0] / l, a[1] / l, a[2] / l]; };

function turned(v, axis, angle) {
  const c = Math.cos(angle), s = Math.sin(angle), k = dot(axis, v) * (1 - c), w = cross(axis, v);
  return [0, 1, 2].map(i => v[i] * c + w[i] * s + axis[i] * k);
}

const copyCamera = c => ({...c, eye: [...c.eye], axes: c.axes.map(a => [...a])});

// Axes stay orthonormal under many small turns.
function turnCamera(camera, axis, angle, pivot) {
  if (pivot) camera.eye = add(pivot, turned(add(camera.eye, pivot, -1), axis, angle));
  const right = unit(turned(camera.axes[0], axis, angle)), down = turned(camera.axes[1], axis, angle);
  const forward = unit(cross(right, down));
  camera.axes = [right, cross(forward, right), forward];
}

// Not past the poles, where left and right would change places.
function tilt(camera, angle, up, pivot) {
  const rise = Math.asin(Math.max(-1, Math.min(1, dot(camera.axes[2], up)))), most = 1.53;
  const wanted = Math.max(Math.min(rise + angle, Math.max(most, rise)), Math.min(-most, rise));
  turnCamera(camera, camera.axes[0], wanted - rise, pivot);
}

// The camera's picture, whole, in the middle of a window.
function inWindow(camera, width, height) {
  const scale = Math.min(width / camera.width, height / camera.height);
  return {...camera, width, height, fx: camera.fx * scale, fy: camera.fy * scale,
    cx: (camera.cx - camera.width / 2) * scale + width / 2, cy: (camera.cy - camera.height / 2) * scale + height / 2};
}

function between(a, b, t) {
  const q = copyCamera(b), mix = (x, y) => x + (y - x) * t;
  q.eye = a.eye.map((x, i) => mix(x, b.eye[i]));
  const right = unit(a.axes[0].map((x, i) => mix(x, b.axes[0][i]))), down = a.axes[1].map((x, i) => mix(x, b.axes[1][i]));
  const forward = unit(cross(right, down));
  q.axes = [right, cross(forward, right), forward];
  for (const k of ["fx", "fy", "cx", "cy"]) q[k] = mix(a[k] / a.height, b[k] / b.height) * b.height;
  return q;
}
