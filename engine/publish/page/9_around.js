// SPDX-License-Identifier: MIT
// A picture of all directions from the place of the first camera: while the page loads, and instead of the scene where
// there is no WebGL 2. Drawn on a plain canvas; one looks around in it, and stays where one is.
class Around {
  constructor() {
    this.camera = copyCamera(scene.cameras[scene.start]);
    this.flying = true;
    this.canvas = document.createElement("canvas");
    Object.assign(this.canvas, {id: "around", tabIndex: 0, ariaLabel: "A picture all around"});
    this.canvas.setAttribute("role", "img");
    element("poster").after(this.canvas);
    let held;
    this.canvas.onpointerdown = event => { this.canvas.setPointerCapture(event.pointerId); held = [event.clientX, event.clientY]; };
    this.canvas.onpointermove = event => {
      if (!held || !this.canvas.hasPointerCapture(event.pointerId)) return;
      look(this, event.clientX - held[0], event.clientY - held[1]);
      held = [event.clientX, event.clientY];
      this.changed();
    };
    this.canvas.onlostpointercapture = () => { held = null; };
    this.canvas.onkeydown = event => {
      const [x, y] = {ArrowLeft: [40, 0], ArrowRight: [-40, 0], ArrowUp: [0, 40], ArrowDown: [0, -40]}[event.key] || [0, 0];
      if (!x && !y) return;
      event.preventDefault();
      event.stopPropagation();
      look(this, x, y);
      this.changed();
    };
    this.resized = new ResizeObserver(() => this.changed());
    this.resized.observe(this.canvas);
    this.ready = this.open();
  }

  async open() {
    const image = new Image();
    image.src = scene.around.picture;
    await image.decode();
    const canvas = document.createElement("canvas");
    [canvas.width, canvas.height] = [image.width, image.height];
    const context = canvas.getContext("2d", {willReadFrequently: true});
    context.drawImage(image, 0, 0);
    this.picture = context.getImageData(0, 0, image.width, image.height);
    element("poster").hidden = true;
    this.changed();
  }

  changed() {
    this.turned = this.picture && (this.turned || 0) + 1;
    this.requested ||= requestAnimationFrame(() => { this.requested = 0; this.draw(); });
  }

  draw() {
    if (!this.picture || !this.canvas.isConnected) return;
    const share = Math.min(1, 720 / Math.max(this.canvas.clientWidth, 1)), width = Math.max(1, Math.round(this.canvas.clientWidth * share)), height = Math.max(1, Math.round(this.canvas.clientHeight * share));
    if (this.canvas.width !== width || this.canvas.height !== height) [this.canvas.width, this.canvas.height] = [width, height];
    const camera = inWindow(this.camera, width, height), context = this.canvas.getContext("2d"), out = context.createImageData(width, height);
    const {data, width: w, height: h} = this.picture, rows = scene.around.axes.map(axis => camera.axes.map(a => dot(axis, a)));
    for (let y = 0, to = 0; y < height; ++y)
      for (let x = 0; x < width; ++x, to += 4) {
        const a = (x + 0.5 - camera.cx) / camera.fx, b = (y + 0.5 - camera.cy) / camera.fy;
        const [right, down, ahead] = rows.map(r => r[0] * a + r[1] * b + r[2]);
        const u = w * (0.5 + Math.atan2(right, ahead) / (2 * Math.PI)) - 0.5, v = Math.max(0, Math.min(h - 1, h * (0.5 + Math.atan2(down, Math.hypot(right, ahead)) / Math.PI) - 0.5));
        const u0 = Math.floor(u), v0 = Math.floor(v), s = u - u0, t = v - v0, left = (u0 + w) % w, next = (u0 + 1) % w, below = Math.min(v0 + 1, h - 1);
        const i = [4 * (v0 * w + left), 4 * (v0 * w + next), 4 * (below * w + left), 4 * (below * w + next)];
        for (let k = 0; k < 3; ++k)
          out.data[to + k] = (1 - t) * ((1 - s) * data[i[0] + k] + s * data[i[1] + k]) + t * ((1 - s) * data[i[2] + k] + s * data[i[3] + k]);
        out.data[to + 3] = 255;
      }
    context.putImageData(out, 0, 0);
  }

  // The scene is there: it is seen as the picture was.
  leave(viewer) {
    if (this.turned > 2) {
      viewer.camera.axes = this.camera.axes.map(a => [...a]);
      viewer.changed();
    }
    this.resized.disconnect();
    this.canvas.remove();
  }
}
