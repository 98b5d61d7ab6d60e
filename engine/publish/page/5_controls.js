// SPDX-License-Identifier: MIT
// Pointers (mouse, pen, fingers), wheel and keys.
const keysDown = new Set();
const keyAxis = {KeyD: [0, 1], KeyA: [0, -1], KeyE: [1, -1], KeyQ: [1, 1], KeyW: [2, 1], KeyS: [2, -1], ArrowUp: [2, 1], ArrowDown: [2, -1]};

function flyByKeys(viewer, seconds) {
  const speed = (keysDown.has("ShiftLeft") || keysDown.has("ShiftRight") ? 2 : 0.5) * scene.radius * seconds;
  for (const key of keysDown)
    if (keyAxis[key]) viewer.camera.eye = add(viewer.camera.eye, viewer.camera.axes[keyAxis[key][0]], keyAxis[key][1] * speed);
  viewer.changed();
}

function pan(viewer, dx, dy) {
  const {camera} = viewer, perPixel = viewer.distance / inWindow(camera, viewer.canvas.clientWidth, viewer.canvas.clientHeight).fx;
  camera.eye = add(add(camera.eye, camera.axes[0], -dx * perPixel), camera.axes[1], -dy * perPixel);
}

function approach(viewer, factor) {
  const distance = Math.min(Math.max(viewer.distance * factor, scene.near * 0.5), scene.radius * 1e3);
  viewer.camera.eye = add(viewer.camera.eye, viewer.camera.axes[2], viewer.distance - distance);
  viewer.distance = distance;
}

function look(viewer, dx, dy) {
  const {camera} = viewer;
  const angle = 1 / Math.max(200, viewer.flying ? inWindow(camera, viewer.canvas.clientWidth, viewer.canvas.clientHeight).fx : 200);
  const pivot = viewer.flying ? null : viewer.focus, sign = viewer.flying ? 1 : -1;
  turnCamera(camera, scene.up, sign * dx * angle, pivot);
  tilt(camera, sign * dy * angle, scene.up, pivot);
}

function listenToPointers(viewer) {
  const {canvas} = viewer, down = new Map();
  const spread = () => {
    const [a, b] = [...down.values()];
    return {x: (a.x + b.x) / 2, y: (a.y + b.y) / 2, size: Math.max(10, Math.hypot(a.x - b.x, a.y - b.y))};
  };
  canvas.addEventListener("pointerdown", event => {
    canvas.setPointerCapture(event.pointerId);
    canvas.focus();
    down.set(event.pointerId, {x: event.clientX, y: event.clientY});
    viewer.flight = null;
  });
  canvas.addEventListener("pointermove", event => {
    const held = down.get(event.pointerId);
    if (!held) return;
    const dx = event.clientX - held.x, dy = event.clientY - held.y, before = down.size > 1 && spread();
    held.x = event.clientX;
    held.y = event.clientY;
    if (down.size > 1) {
      const after = spread();
      if (viewer.walker) return;
      pan(viewer, after.x - before.x, after.y - before.y);
      approach(viewer, before.size / after.size);
    } else if (!viewer.walker && (event.buttons & 6 || event.shiftKey)) {
      pan(viewer, dx, dy);
    } else {
      look(viewer, dx, dy);
    }
    viewer.changed();
  });
  for (const name of ["pointerup", "pointercancel", "lostpointercapture"])
    canvas.addEventListener(name, event => down.delete(event.pointerId));
  canvas.addEventListener("contextmenu", event => event.preventDefault());
  canvas.addEventListener("wheel", event => {
    event.preventDefault();
    viewer.flight = null;
    if (!viewer.walker) approach(viewer, Math.exp(Math.max(-100, Math.min(100, event.deltaY * (event.deltaMode ? 30 : 1))) / 500));
    viewer.changed();
  }, {passive: false});
}

function listenToKeys(viewer, actions) {
  addEventListener("keydown", event => {
    if (event.ctrlKey || event.metaKey || event.altKey || document.getElementById("help").open) return;
    const action = actions[event.key] || actions[event.key.toLowerCase()];
    if (keyAxis[event.code] || event.code.startsWith("Shift")) {
      if (event.target.tagName === "BUTTON" && event.code.startsWith("Arrow")) return;
      viewer.flight = null;
      keysDown.add(event.code);
      if (keyAxis[event.code] && !event.repeat && !viewer.walker) flyByKeys(viewer, 1 / 60);
      viewer.changed();
      if (keyAxis[event.code]) event.preventDefault();
    } else if (action && !event.repeat) {
      event.preventDefault();
      action();
    }
  });
  addEventListener("keyup", event => keysDown.delete(event.code));
  addEventListener("blur", () => keysDown.clear());
}
