// SPDX-License-Identifier: MIT
// What is on show: the camera, its order of splats, and a picture whenever either changes. In motion a picture has
// a share of the window's pixels each way, and the splats of a level: about a quarter of those of the one before.
const paces = [[1, 0], [0.7, 0], [0.5, 0], [0.5, 1], [0.35, 1], [0.25, 1], [0.25, 2]];
const levelsBelow = 2, fewSplats = 1000;  // which need no levels

const makeWorker = () => new Worker(URL.createObjectURL(new Blob([document.getElementById("worker").textContent], {type: "text/javascript"})));

class Viewer {
  constructor(canvas, renderer) {
    this.canvas = canvas;
    this.renderer = renderer;
    this.worker = makeWorker();
    this.worker.onmessage = ({data}) => this.sorted(data);
    this.worker.onerror = event => say("Sorting failed: " + event.message);
    this.number = this.version = 0;
    this.camera = copyCamera(scene.cameras[scene.start]);
    this.distance = this.camera.pivot;  // what orbiting turns about is so far ahead
    this.step = this.pace = this.frames = 0;
    this.flying = false;
    this.moved = -1e9;
    new ResizeObserver(() => this.changed()).observe(canvas);
  }

  load(splats) {
    this.add(splats);
    this.splats = {...splats, position: null};
    this.changed();
  }

  add(splats) {
    this.renderer.upload(splats);
    this.begun = true;
    this.worker.postMessage({level: this.renderer.levels.length - 1, position: splats.position}, [splats.position.buffer]);
  }

  // The splats go to a worker, which merges them; where that fails pictures in motion have all of them.
  makeLevels() {
    const splats = this.splats;
    this.splats = null;
    if (!splats || scene.count < fewSplats) return;
    const worker = makeWorker();
    worker.onmessage = ({data}) => {
      try { this.add(data.splats); } catch { data.level = levelsBelow; }
      if (data.level === levelsBelow) worker.terminate();
    };
    worker.postMessage({merge: splats, columns: scene.columns, exact: scene.exact, levels: levelsBelow, middle: scene.focus, radius: scene.radius, secondMoment: scene.secondMoment},
      splats.layers.map(a => a.buffer));
  }

  get focus() { return add(this.camera.eye, this.camera.axes[2], this.distance); }

  jumpTo(camera, smoothly) {
    const from = this.camera, start = performance.now();
    this.distance = camera.pivot;
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
    this.stream?.look();
    this.request();
  }

  request() {
    if (this.begun && !this.requested && !this.held) this.requested = requestAnimationFrame(now => this.frame(now));
  }

  // One order is under way at a time; the camera it is for may have moved on when it comes. ranges: of the splats of a
  // streamed scene that are on show, first and count.
  sort(camera, level = 0) {
    this.sorting = {...camera, level, version: this.version};
    this.worker.postMessage({id: ++this.number, level, row: camera.axes[2], centre: camera.eye, near: scene.near, ranges: this.ranges});
  }

  sorted({order}) {
    this.orderOf = this.sorting;
    this.renderer.setOrder(order, this.orderOf.level);
    this.sorting = null;
    this.stream?.sorted(this.orderOf.version);
    this.wake?.();
    this.request();
  }

  sameOrder(camera, level) {
    const o = this.orderOf;
    return o && o.level === level && o.version === this.version && o.eye.every((x, i) => x === camera.eye[i]) && o.axes[2].every((x, i) => x === camera.axes[2][i]);
  }

  frame(now) {
    this.requested = 0;
    if (this.held) return;
    const moving = this.flight || keysDown.size || now - this.moved < 250 || this.walker?.moving;
    const since = now - this.last;  // not a number after a rest
    this.last = moving ? now : NaN;
    if (this.flight && !this.flight(now)) this.flight = null;
    if (this.walker) this.walker.advance(Math.min(since || 16, 250) / 1000);
    else if (keysDown.size) flyByKeys(this, Math.min(since || 16, 100) / 1000);
    // Fewer pixels while it moves and frames are slow; all of them at rest.
    if (moving && since) this.adapt(since);
    const ratio = Math.min(devicePixelRatio || 1, 2);
    const width = Math.max(1, Math.round(this.canvas.clientWidth * ratio)), height = Math.max(1, Math.round(this.canvas.clientHeight * ratio));
    if (this.canvas.width !== width || this.canvas.height !== height) { this.canvas.width = width; this.canvas.height = height; }
    const [scale, wanted] = moving ? paces[this.step] : paces[0], level = Math.min(wanted, this.renderer.levels.length - 1);
    const camera = inWindow(this.camera, Math.max(1, Math.round(width * scale)), Math.max(1, Math.round(height * scale)));
    const sorted = this.sameOrder(camera, level);
    if (!this.sorting && !sorted) this.sort(copyCamera(camera), level);
    // In motion the order of the frame before does; at rest a picture takes too long to draw it twice.
    if (this.orderOf && (moving || sorted)) {
      const begun = performance.now();
      this.renderer.draw(camera, !moving, this.orderOf.level);
      ++this.frames;
      if (!this.shown) this.showFirst(begun);
    }
    this.notes?.place(inWindow(this.camera, this.canvas.clientWidth, this.canvas.clientHeight));
    if (moving) this.request();
  }

  // Where the first picture takes long, motion begins some steps down.
  showFirst(begun) {
    this.renderer.finish();
    if (performance.now() - begun > 500) this.step = 4;
    this.shown = true;
    firstPicture();
    this.makeLevels();
  }

  // One step down after 3 slow frames, or after one of a quarter of a second, and three after one of a whole; one up
  // after 20 quick ones.
  adapt(since) {
    if (since > 250) this.pace = -2;
    this.pace = since > 50 ? Math.min(this.pace, 0) - 1 : since < 20 ? Math.max(this.pace, 0) + 1 : 0;
    if (this.pace > -3 && this.pace < 20) return;
    const step = this.step + (this.pace > 0 ? -1 : since > 1000 ? 3 : 1);
    this.step = Math.max(0, Math.min(paces.length - 1, step));
    this.pace = 0;
  }

  // For tests and for pictures: this camera at its own size, in its own order. -> PNG as a data URL
  async picture(camera, level = 0) {
    await this.stream?.settled(camera);
    this.held = true;
    try {
      while (this.sorting) await new Promise(done => { this.wake = done; });
      this.sort(copyCamera(camera), level);
      while (this.sorting) await new Promise(done => { this.wake = done; });
      this.canvas.width = camera.width;
      this.canvas.height = camera.height;
      this.format = this.renderer.draw(camera, this.fine ?? true, level);
      return this.canvas.toDataURL("image/png");
    } finally {
      this.held = false;
      this.changed();
    }
  }
}
