// What is on show: the camera, its order of splats, and a picture whenever either changes. In motion a picture has
// one of these shares of the window's pixels each way.
const shares = [1, 0.7, 0.5, 0.35, 0.25];

class Viewer {
  constructor(canvas, renderer) {
    this.canvas = canvas;
    this.renderer = renderer;
    this.worker = new Worker(URL.createObjectURL(new Blob([document.getElementById("sorter").textContent], {type: "text/javascript"})));
    this.worker.onmessage = ({data}) => this.sorted(data);
    this.worker.onerror = event => say("Sorting failed: " + event.message);
    this.number = 0;
    this.camera = copyCamera(scene.cameras[scene.start]);
    this.distance = focusOf(this.camera);
    this.step = this.pace = 0;
    this.flying = false;
    this.moved = -1e9;
    new ResizeObserver(() => this.changed()).observe(canvas);
  }

  load(splats) {
    this.renderer.upload(splats);
    this.worker.postMessage({position: splats.position}, [splats.position.buffer]);
    this.loaded = true;
    this.changed();
  }

  get focus() { return add(this.camera.eye, this.camera.axes[2], this.distance); }

  jumpTo(camera, smoothly) {
    const from = this.camera, start = performance.now();
    this.distance = focusOf(camera);
    this.flight = smoothly && !matchMedia("(prefers-reduced-motion: reduce)").matches && (now => {
      const t = Math.min(1, (now - start) / 500);
      this.camera = t < 1 ? between(from, camera, t * t * (3 - 2 * t)) : copyCamera(camera);
      return t < 1;
    });
    if (!this.flight) this.camera = copyCamera(camera);
    this.changed();
  }

  changed() {
    this.moved = performance.now();
    this.request();
  }

  request() {
    if (this.loaded && !this.requested && !this.held) this.requested = requestAnimationFrame(now => this.frame(now));
  }

  // One order is under way at a time; the camera it is for may have moved on when it comes.
  sort(camera) {
    this.sorting = camera;
    this.worker.postMessage({id: ++this.number, row: camera.axes[2], centre: camera.eye, near: scene.near});
  }

  sorted({order}) {
    this.renderer.setOrder(order);
    this.orderOf = this.sorting;
    this.sorting = null;
    this.wake?.();
    this.request();
  }

  sameOrder(camera) {
    const o = this.orderOf;
    return o && o.eye.every((x, i) => x === camera.eye[i]) && o.axes[2].every((x, i) => x === camera.axes[2][i]);
  }

  frame(now) {
    this.requested = 0;
    if (this.held) return;
    const moving = this.flight || keysDown.size || now - this.moved < 250;
    const since = now - this.last;  // not a number after a rest
    this.last = moving ? now : NaN;
    if (this.flight && !this.flight(now)) this.flight = null;
    if (keysDown.size) flyByKeys(this, Math.min(since || 16, 100) / 1000);
    // Fewer pixels while it moves and frames are slow; all of them at rest.
    if (moving && since) this.adapt(since);
    const ratio = Math.min(devicePixelRatio || 1, 2);
    const width = Math.max(1, Math.round(this.canvas.clientWidth * ratio)), height = Math.max(1, Math.round(this.canvas.clientHeight * ratio));
    if (this.canvas.width !== width || this.canvas.height !== height) { this.canvas.width = width; this.canvas.height = height; }
    const scale = moving ? shares[this.step] : 1;
    const camera = inWindow(this.camera, Math.max(1, Math.round(width * scale)), Math.max(1, Math.round(height * scale)));
    if (!this.sorting && !this.sameOrder(camera)) this.sort(copyCamera(camera));
    if (this.orderOf) {
      this.renderer.draw(camera, !moving);
      if (!this.shown) { this.shown = true; firstPicture(); }
    }
    if (moving) this.request();
  }

  // One step down after 3 slow frames, or after one of a quarter of a second; one up after 20 quick ones.
  adapt(since) {
    if (since > 250) this.pace = -2;
    this.pace = since > 50 ? Math.min(this.pace, 0) - 1 : since < 20 ? Math.max(this.pace, 0) + 1 : 0;
    if (this.pace > -3 && this.pace < 20) return;
    this.step = Math.max(0, Math.min(shares.length - 1, this.step + (this.pace < 0 ? 1 : -1)));
    this.pace = 0;
  }

  // For tests and for pictures: this camera at its own size, in its own order. -> PNG as a data URL
  async picture(camera) {
    this.held = true;
    try {
      while (this.sorting) await new Promise(done => { this.wake = done; });
      this.sort(copyCamera(camera));
      while (this.sorting) await new Promise(done => { this.wake = done; });
      this.canvas.width = camera.width;
      this.canvas.height = camera.height;
      this.format = this.renderer.draw(camera, this.fine ?? true);
      return this.canvas.toDataURL("image/png");
    } finally {
      this.held = false;
      this.changed();
    }
  }
}
