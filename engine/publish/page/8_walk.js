// SPDX-License-Identifier: MIT
// Walking: a capsule on the triangles of a collider, with gravity. Steps of up to 0.4 m are climbed: what blocks is the
// part of the capsule above that height, and what carries is the highest ground below it. Frame: u and v level, h up.
const body = {radius: 0.25, height: 1.7, eye: 1.6, step: 0.4, speed: 1.5, fall: 9.81, tick: 1 / 60};  // m, s
const mix3 = (a, b, t) => [0, 1, 2].map(k => a[k] + t * (b[k] - a[k]));

function nearestOfTriangle(p, [a, b, c]) {
  const ab = add(b, a, -1), ac = add(c, a, -1), ap = add(p, a, -1), d1 = dot(ab, ap), d2 = dot(ac, ap);
  if (d1 <= 0 && d2 <= 0) return a;
  const bp = add(p, b, -1), d3 = dot(ab, bp), d4 = dot(ac, bp);
  if (d3 >= 0 && d4 <= d3) return b;
  const vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return add(a, ab, d1 / (d1 - d3));
  const cp = add(p, c, -1), d5 = dot(ab, cp), d6 = dot(ac, cp);
  if (d6 >= 0 && d5 <= d6) return c;
  const vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return add(a, ac, d2 / (d2 - d6));
  const va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) return mix3(b, c, (d4 - d3) / (d4 - d3 + d5 - d6));
  const all = va + vb + vc;
  return all > 0 ? add(add(a, ab, vb / all), ac, vc / all) : a;
}

class Ground {
  constructor({low, step, vertices, faces, data, metres}) {
    const bytes = fromBase64(data), view = new DataView(bytes.buffer), points = [];
    this.unit = metres > 0 ? 1 / metres : 1;  // of the scene in a metre
    const forward = Math.abs(scene.up[0]) < 0.9 ? [1, 0, 0] : [0, 1, 0], u = unit(cross(scene.up, forward));
    this.axes = [u, scene.up, cross(u, scene.up)];
    for (let i = 0; i < vertices; ++i)
      points.push(this.toFrame([0, 1, 2].map(k => low[k] + step[k] * view.getUint16(6 * i + 2 * k, true))));
    this.triangles = [];
    this.cells = new Map();
    this.cell = 1;
    for (let f = 0, at = 6 * vertices; f < faces; ++f, at += 12) this.addTriangle([0, 4, 8].map(k => points[view.getUint32(at + k, true)]));
  }

  toFrame(p) { return this.axes.map(axis => dot(axis, p) / this.unit); }
  toScene(p) { return [0, 1, 2].map(k => this.unit * (this.axes[0][k] * p[0] + this.axes[1][k] * p[1] + this.axes[2][k] * p[2])); }

  // Cells are squares of a metre in the level plane.
  addTriangle(corners) {
    const normal = unit(cross(add(corners[1], corners[0], -1), add(corners[2], corners[0], -1))), id = this.triangles.length;
    this.triangles.push({corners, normal, low: Math.min(...corners.map(c => c[1])), high: Math.max(...corners.map(c => c[1]))});
    const [u0, u1, v0, v1] = [0, 2].flatMap(k => [Math.min(...corners.map(c => c[k])), Math.max(...corners.map(c => c[k]))].map(x => Math.floor(x / this.cell)));
    for (let u = u0; u <= u1; ++u)
      for (let v = v0; v <= v1; ++v) {
        const key = u + "," + v;
        if (!this.cells.has(key)) this.cells.set(key, []);
        this.cells.get(key).push(id);
      }
  }

  near(u, v, reach) {
    const found = new Set();
    for (let x = Math.floor((u - reach) / this.cell); x <= Math.floor((u + reach) / this.cell); ++x)
      for (let y = Math.floor((v - reach) / this.cell); y <= Math.floor((v + reach) / this.cell); ++y)
        this.cells.get(x + "," + y)?.forEach(id => found.add(id));
    return [...found].map(id => this.triangles[id]);
  }

  // The highest ground on a vertical line between two heights; -Infinity where there is none.
  heightAt(u, v, top, bottom) {
    let best = -Infinity;
    for (const {corners: [a, b, c], normal, low, high} of this.near(u, v, 0)) {
      if (Math.abs(normal[1]) < 1e-6 || low > top || high < bottom) continue;
      const side = (p, q) => (q[0] - p[0]) * (v - p[2]) - (q[2] - p[2]) * (u - p[0]), s = [side(a, b), side(b, c), side(c, a)];
      if (Math.min(...s) < -1e-9 && Math.max(...s) > 1e-9) continue;
      const h = a[1] - (normal[0] * (u - a[0]) + normal[2] * (v - a[2])) / normal[1];
      if (h <= top && h >= bottom && h > best) best = h;
    }
    return best;
  }

  // Under the feet: the middle, and a ring around it that finds the edge of a step before the middle is over it.
  under([u, h, v], reach, fall) {
    let best = -Infinity;
    for (let k = 0; k < 9; ++k) {
      const r = k ? reach : 0;
      best = Math.max(best, this.heightAt(u + r * Math.cos(k * Math.PI / 4), v + r * Math.sin(k * Math.PI / 4), h + body.step, h - fall));
    }
    return best;
  }

  // Pushes the capsule above the height of a step out of walls and ceilings.
  pushOut(feet) {
    for (let round = 0; round < 4; ++round) {
      let deepest = 1e-6, push;
      for (const {corners} of this.near(feet[0], feet[2], body.radius)) {
        const from = [feet[0], feet[1] + body.step + body.radius, feet[2]], length = body.height - body.step - 2 * body.radius;
        let p = from, q;
        for (let k = 0; k < 6; ++k) {  // between two convex sets, to the nearest pair
          q = nearestOfTriangle(p, corners);
          p = [from[0], from[1] + Math.max(0, Math.min(length, q[1] - from[1])), from[2]];
        }
        const out = add(p, q, -1), distance = Math.hypot(...out);
        if (distance >= body.radius || body.radius - distance < deepest || distance < 1e-9) continue;
        deepest = body.radius - distance;
        const level = Math.hypot(out[0], out[2]);
        push = level > 1e-9 ? [out[0] / level * deepest, 0, out[2] / level * deepest] : null;
      }
      if (!push) return;
      feet[0] += push[0];
      feet[2] += push[2];
    }
  }
}

class Walker {
  constructor(viewer) {
    this.viewer = viewer;
    this.ground = new Ground(scene.collider);
    this.stick = [0, 0];
    this.rest = this.fallen = 0;
    this.makeStick();
  }

  // Where the camera stands, or where a bookmark does that has ground below it.
  begin() {
    const cameras = [this.viewer.camera, ...scene.cameras];
    for (const camera of cameras) {
      const eye = this.ground.toFrame(camera.eye), h = this.ground.heightAt(eye[0], eye[2], eye[1], eye[1] - 100);
      if (h === -Infinity) continue;
      if (camera !== this.viewer.camera) this.viewer.camera = copyCamera(camera);
      this.feet = [eye[0], h, eye[2]];
      this.ground.pushOut(this.feet);
      this.fallen = this.rest = 0;
      this.see();
      return true;
    }
    say("There is no ground below any camera, so nobody can walk here.");
    return false;
  }

  // A tick with a wish for a direction, in the level plane, of length 1 at most.
  tick(wish, speed) {
    const before = [...this.feet], {ground} = this;
    this.feet[0] += wish[0] * speed * body.tick;
    this.feet[2] += wish[1] * speed * body.tick;
    ground.pushOut(this.feet);
    this.fallen = Math.min(50, this.fallen + body.fall * body.tick);
    const fall = this.fallen * body.tick, held = this.standing ? body.step : 0;
    const h = ground.under(this.feet, 0.7 * body.radius, Math.max(fall, held));
    if (h > -Infinity) {
      this.feet[1] = h;
      this.fallen = 0;
      this.standing = true;
      return;
    }
    // Beyond the collider there is nothing to fall on: stay.
    this.standing = ground.under(this.feet, 0, 1000) === -Infinity;
    if (!this.standing) this.feet[1] -= fall;
    else [this.feet, this.fallen] = [before, 0];
  }

  see() { this.viewer.camera.eye = this.ground.toScene(add(this.feet, [0, 1, 0], body.eye)); }

  wish() {
    const axes = this.viewer.camera.axes.map(axis => this.ground.axes.map(a => dot(a, axis))), level = a => unit([a[0], 0, a[2]]);
    const ahead = level(Math.abs(axes[2][1]) < 0.95 ? axes[2] : axes[1].map(x => axes[2][1] > 0 ? x : -x)), right = level(axes[0]);
    let x = this.stick[0], z = -this.stick[1];
    for (const key of keysDown) {
      const [axis, by] = keyAxis[key] || [];
      if (axis === 0) x += by;
      if (axis === 2) z += by;
    }
    const size = Math.max(1, Math.hypot(x, z));
    return [0, 2].map(k => (ahead[k] * z + right[k] * x) / size);
  }

  get moving() { return this.standing === false || this.wish().some(x => x); }

  advance(seconds) {
    this.rest += Math.min(seconds, 0.25);
    const speed = body.speed * (keysDown.has("ShiftLeft") || keysDown.has("ShiftRight") ? 2.5 : 1);
    for (; this.rest >= body.tick; this.rest -= body.tick) this.tick(this.wish(), speed);
    this.see();
  }

  makeStick() {
    const knob = document.createElement("span"), stick = document.createElement("div");
    stick.id = "stick";
    stick.hidden = true;
    stick.setAttribute("aria-hidden", "true");
    stick.append(knob);
    element("view").after(stick);
    const move = event => {
      const box = stick.getBoundingClientRect(), x = (event.clientX - box.left) / box.width * 2 - 1, y = (event.clientY - box.top) / box.height * 2 - 1, size = Math.max(1, Math.hypot(x, y));
      this.stick = [x / size, y / size];
      knob.style.transform = `translate(${30 * x / size}px, ${30 * y / size}px)`;
      this.viewer.changed();
    };
    stick.onpointerdown = event => { stick.setPointerCapture(event.pointerId); move(event); };
    stick.onpointermove = event => { if (stick.hasPointerCapture(event.pointerId)) move(event); };
    stick.onlostpointercapture = () => { this.stick = [0, 0]; knob.style.transform = ""; };
    this.element = stick;
  }

  // For tests: from these feet (scene), legs of [u, v, seconds]; -> the feet after each.
  path(legs) {
    return legs.map(([u, v, seconds]) => {
      for (let k = Math.round(seconds / body.tick); k > 0; --k) this.tick([u, v], body.speed);
      this.see();
      return {feet: [...this.feet], standing: this.standing};
    });
  }
}
