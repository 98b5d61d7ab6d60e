// SPDX-License-Identifier: MIT
// A scene in files of streamed SOG (engine/scene/streamed_sog.cpp): the coarsest level first, then what is nearest and
// largest in the picture, finer and finer, as far as the budget of splats goes.
const retryFirst = 500, retryMost = 15000, silence = 15000, planPause = 150;  // ms
const mostRequests = 6, mostFiles = 2;                                        // at a time

class Missing extends Error {}
const parting = () => new DOMException("not wanted any more", "AbortError");

// Splats that this device takes at a time: ?budget=2M in the address, else by its memory.
function budgetOfDevice() {
  const asked = /^(\d+(?:\.\d+)?)([kM]?)$/.exec(new URLSearchParams(location.search).get("budget") || "");
  if (asked) return Math.max(1, Math.round(asked[1] * {"": 1, k: 1e3, M: 1e6}[asked[2]]));
  const phone = navigator.userAgentData?.mobile || matchMedia("(pointer: coarse)").matches;
  return (phone ? 0.25e6 : 0.5e6) * Math.min(8, navigator.deviceMemory || (phone ? 4 : 8));
}

// The files of the page's own folder.
const network = {
  free: mostRequests, queue: [], cut: false, requests: 0, retries: 0,

  async once(name, signal) {
    if (this.free) --this.free;
    else await new Promise(go => this.queue.push(go));
    const own = new AbortController(), stop = () => own.abort();
    let timer;
    const alive = () => { clearTimeout(timer); timer = setTimeout(stop, silence); };
    signal.addEventListener("abort", stop);
    try {
      if (signal.aborted) throw parting();
      alive();
      ++this.requests;
      const answer = await fetch(name, {signal: own.signal});
      if (!answer.ok && answer.status < 500 && answer.status !== 408 && answer.status !== 429) throw new Missing(`${name} is not there (${answer.status})`);
      if (!answer.ok) throw Error(`${name}: ${answer.status}`);
      const blocks = [], reader = answer.body.getReader();
      for (let block; !(block = await reader.read()).done; blocks.push(block.value)) alive();
      return new Blob(blocks);
    } finally {
      clearTimeout(timer);
      signal.removeEventListener("abort", stop);
      const next = this.queue.shift();
      if (next) next();
      else ++this.free;
    }
  },

  // Again and again while the network is cut, as long as somebody wants the file.
  async file(name, signal) {
    for (let wait = retryFirst;; wait = Math.min(2 * wait, retryMost)) {
      try {
        const blob = await this.once(name, signal);
        if (this.cut) element("note").hidden = true;
        this.cut = false;
        return blob;
      } catch (error) {
        if (signal.aborted) throw parting();
        if (error instanceof Missing) throw error;
      }
      ++this.retries;
      this.cut = true;
      say(`The network does not answer. Trying again in ${Math.ceil(wait / 1000)} s; what is loaded stays.`);
      await new Promise(done => {
        const end = () => { clearTimeout(timer); removeEventListener("online", end); signal.removeEventListener("abort", end); done(); };
        const timer = setTimeout(end, wait);
        addEventListener("online", end);
        signal.addEventListener("abort", end);
      });
    }
  },

  json: async (name, signal) => JSON.parse(await (await network.file(name, signal)).text()),
  picture: async (name, signal) => createImageBitmap(await network.file(name, signal), {premultiplyAlpha: "none", colorSpaceConversion: "none"}),
};

// Centres for the sort, from the low and the high bytes of their logarithms.
function centresOf(meta, low, high) {
  const pixels = picture => {
    const context = new OffscreenCanvas(picture.width, picture.height).getContext("2d", {willReadFrequently: true});
    context.drawImage(picture, 0, 0);
    return context.getImageData(0, 0, picture.width, picture.height).data;
  };
  const l = pixels(low), u = pixels(high), centres = new Float32Array(3 * meta.count);
  for (let k = 0; k < 3; ++k) {
    const least = meta.means.mins[k], step = (meta.means.maxs[k] - least) / 65535;
    for (let i = 0; i < meta.count; ++i) {
      const x = least + step * (l[4 * i + k] + 256 * u[4 * i + k]);
      centres[3 * i + k] = Math.sign(x) * Math.expm1(Math.abs(x));
    }
  }
  return centres;
}

async function fetchChunk(file, signal) {
  const meta = await network.json(file.name, signal), folder = file.name.slice(0, file.name.lastIndexOf("/") + 1);
  const names = [...meta.means.files, meta.quats.files[0], meta.scales.files[0], meta.sh0.files[0], ...meta.shN ? [meta.shN.files[1], meta.shN.files[0]] : []];
  const pictures = await Promise.all(names.map(name => network.picture(folder + name, signal)));
  if (!(meta.count >= file.count) || pictures.slice(0, 5).some(p => p.width * p.height < meta.count)) throw Error("splats are missing");
  return {meta, pictures, centres: centresOf(meta, pictures[0], pictures[1])};
}

// The pictures become textures, which the projection reads.
function uploadChunk(renderer, {meta, pictures}) {
  const {gl} = renderer, textures = pictures.map(picture => {
    const made = renderer.texture(gl.TEXTURE_2D, gl.RGBA8, picture.width, picture.height);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, gl.RGBA, gl.UNSIGNED_BYTE, picture);
    picture.close();
    return made;
  });
  if (!meta.shN) textures.push(textures[0], textures[0]);
  const books = new Float32Array(1024);
  [meta.scales, meta.sh0, meta.shN].forEach((group, k) => group?.codebook.forEach((value, i) => { books[4 * i + k] = value; }));
  textures.push(renderer.texture(gl.TEXTURE_2D, gl.RGBA32F, 256, 1));
  gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, 256, 1, gl.RGBA, gl.FLOAT, books);
  const bands = meta.shN ? meta.shN.bands ?? {3: 1, 8: 2, 15: 3}[pictures[6].width / 64] : 0;
  return {textures, mins: meta.means.mins, maxs: meta.means.maxs, count: meta.count, terms: (bands + 1) ** 2 - 1};
}

function projectChunks(renderer, level) {
  const {gl, project, columns} = renderer, names = ["means_l", "means_u", "quats", "scales", "sh0", "labels", "palette", "books"];
  gl.enable(gl.SCISSOR_TEST);
  for (const chunk of level.chunks) {
    renderer.bind(project, names, chunk.textures);
    gl.uniform3fv(project.at("mins"), chunk.mins);
    gl.uniform3fv(project.at("maxs"), chunk.maxs);
    for (const name of ["count", "terms"]) gl.uniform1i(project.at(name), chunk[name]);
    gl.uniform1i(project.at("columns"), columns);
    for (const run of chunk.runs) {
      gl.scissor(0, run.row, columns, run.rows);
      gl.uniform1i(project.at("shift"), (run.row - run.first) * columns);
      gl.drawArrays(gl.TRIANGLES, 0, 3);
    }
  }
  gl.disable(gl.SCISSOR_TEST);
}

// Files are away, loading, here, leaving or failed. A leaf of the tree has some rows of a file of each level.
class Stream {
  constructor(viewer, budget) {
    this.viewer = viewer;
    this.budget = budget;
    this.active = this.missing = 0;
    this.waiting = [];
  }

  async open() {
    if (location.protocol === "file:") throw Error("a browser lets no page read the files beside it from disk; serve its folder, for example with python3 -m http.server");
    const meta = await network.json("lod-meta.json", new AbortController().signal);
    if (meta.version !== 1) throw Error(`lod-meta.json has version ${meta.version}, and 1 is known`);
    this.coarsest = meta.lodLevels - 1;
    this.readTree(meta);
    this.makeRows();
    this.viewer.stream = this;
    this.plan();
  }

  readTree(meta) {
    this.leaves = [];
    this.files = meta.filenames.map(name => ({name, count: 0, leaves: [], state: "away"}));
    const visit = node => {
      node.children?.forEach(visit);
      if (!node.lods) return;
      const {min, max} = node.bound, leaf = {min, max, middle: min.map((x, k) => (x + max[k]) / 2), radius: Math.hypot(...min.map((x, k) => max[k] - x)) / 2, lods: []};
      for (const [level, lod] of Object.entries(node.lods)) {
        const file = this.files[lod.file];
        leaf.lods[level] = {...lod, file};
        file.level = Number(level);
        file.count = Math.max(file.count, lod.offset + lod.count);
        file.leaves.push(leaf);
      }
      this.leaves.push(leaf);
    };
    visit(meta.tree);
  }

  // Rows of the level that all chunks share, at most as many as the budget allows; fewer where memory is short.
  makeRows() {
    const {renderer} = this.viewer, {columns} = renderer;
    for (const file of this.files) file.rows = Math.ceil(file.count / columns);
    const all = this.files.reduce((sum, file) => sum + file.rows, 0), least = Math.min(...this.files.map(file => file.rows));
    for (let rows = Math.min(all, Math.max(least, Math.ceil(Math.min(this.budget, renderer.most) / columns)));; rows >>= 1) {
      try {
        renderer.finishLevel({rows, count: 0, chunks: new Set()});
        this.rows = rows;
        break;
      } catch (error) { if (rows < 2 * least) throw error; }
    }
    this.free = Array.from({length: this.rows}, (_, row) => row);
    this.viewer.worker.postMessage({level: 0, room: this.rows * columns});
  }

  // How large a leaf is in the picture; outside of it a fifth of that.
  weight(leaf, camera) {
    const away = add(leaf.middle, camera.eye, -1), along = dot(away, camera.axes[2]), aside = Math.sqrt(Math.max(0, dot(away, away) - along * along));
    const slope = Math.hypot(camera.width, camera.height) / 2 / Math.min(camera.fx, camera.fy);
    const seen = along > -leaf.radius && aside <= along * slope + leaf.radius * Math.hypot(1, slope);
    const distance = Math.hypot(...camera.eye.map((x, k) => Math.max(leaf.min[k] - x, x - leaf.max[k], 0)));
    return leaf.radius / (distance + 0.5 * leaf.radius) * (seen ? 1 : 0.2);
  }

  // Which files this camera wants: the coarsest level, then steps to finer ones where splats are largest in the picture.
  choose(camera) {
    let room = this.rows, rank = 0;
    const take = file => {
      if (file.state === "failed" || file.rows > room) return false;
      room -= file.rows;
      file.rank = rank++;
      return file.wanted = true;
    };
    for (const file of this.files) Object.assign(file, {wanted: false, users: 0, weight: 0});
    const steps = [];
    for (const leaf of this.leaves) {
      const weight = this.weight(leaf, camera);
      leaf.level = undefined;
      leaf.lods.forEach(({file}, level) => {
        const coarser = leaf.lods.slice(level + 1).find(lod => lod)?.count ?? 1;
        file.weight = Math.max(file.weight, weight);
        if (level < this.coarsest) steps.push({leaf, level, gain: weight / Math.sqrt(coarser)});
      });
    }
    this.files.filter(file => file.level === this.coarsest).sort((a, b) => b.weight - a.weight).forEach(take);
    for (const {leaf, level} of steps.sort((a, b) => b.gain - a.gain)) {
      const {file} = leaf.lods[level], before = leaf.lods[leaf.level]?.file;
      if (!file.wanted && !take(file)) continue;
      ++file.users;
      leaf.level = level;
      if (before && --before.users === 0) {
        before.wanted = false;
        room += before.rows;
      }
    }
  }

  plan() {
    clearTimeout(this.timer);
    this.timer = 0;
    this.choose(this.fixed || inWindow(this.viewer.camera, this.viewer.canvas.clientWidth || 1, this.viewer.canvas.clientHeight || 1));
    for (const file of this.files) if (file.state === "loading" && !file.wanted) file.stop.abort();
    this.next();
  }

  // Soon after the camera moved.
  look() { this.timer ||= setTimeout(() => this.plan(), planPause); }

  next() {
    const wanted = this.files.filter(file => file.wanted), away = wanted.filter(file => file.state === "away").sort((a, b) => a.rank - b.rank);
    while (this.active < mostFiles && away.length) this.load(away.shift());
    this.missing = wanted.filter(file => file.state !== "here" && file.state !== "failed").length;
    element("loading").hidden = !this.missing;
    element("bar").style.width = 100 * (1 - this.missing / (wanted.length || 1)) + "%";
    element("loaded").textContent = `${wanted.length - this.missing} of ${wanted.length} parts`;
    if (!this.missing && !this.timer) this.waiting.splice(0).forEach(done => done());
  }

  async load(file) {
    ++this.active;
    file.state = "loading";
    file.stop = new AbortController();
    try {
      const {signal} = file.stop, parts = await fetchChunk(file, signal);
      const rows = await this.roomFor(file, signal);
      this.place(file, parts, rows);
      file.state = "here";
      this.show();
    } catch (error) {
      file.state = file.stop.signal.aborted ? "away" : "failed";
      file.stop.abort();
      if (file.state === "failed") say(error instanceof Missing ? error.message + "." : `${file.name} is damaged: ${error.message}.`);
    }
    --this.active;
    this.plan();
  }

  // Chunks that are not wanted leave, the least important first, once no order holds them.
  async roomFor(file, signal) {
    for (;;) {
      if (signal.aborted) throw parting();
      if (this.free.length >= file.rows) return this.free.splice(0, file.rows);
      let coming = this.free.length + this.files.reduce((sum, f) => sum + (f.state === "leaving" ? f.rows : 0), 0);
      for (const victim of this.files.filter(f => f.state === "here" && !f.wanted).sort((a, b) => a.weight - b.weight)) {
        if (coming >= file.rows) break;
        victim.state = "leaving";
        coming += victim.rows;
      }
      this.show();
      await new Promise(done => { this.changed = done; setTimeout(done, 1000); });
    }
  }

  place(file, parts, rows) {
    const {renderer, worker} = this.viewer, {columns} = renderer, level = renderer.levels[0];
    rows.sort((a, b) => a - b);
    file.runs = [];
    rows.forEach((row, i) => {
      const last = file.runs.at(-1);
      if (last && last.row + last.rows === row) ++last.rows;
      else file.runs.push({row, first: i, rows: 1});
    });
    file.chunk = {...uploadChunk(renderer, parts), runs: file.runs};
    level.chunks.add(file.chunk);
    for (const run of file.runs) {
      const position = parts.centres.slice(3 * run.first * columns, 3 * (run.first + run.rows) * columns);
      worker.postMessage({level: 0, at: run.row * columns, position}, [position.buffer]);
    }
  }

  // The finest level of each leaf that is here, once all of the coarsest is.
  show() {
    const {viewer} = this, {columns} = viewer.renderer, ranges = [];
    viewer.begun ||= this.files.every(file => file.level !== this.coarsest || !file.wanted || file.state === "here" || file.state === "failed");
    if (!viewer.begun) return;
    for (const leaf of this.leaves) {
      const lod = leaf.lods.find(lod => lod?.file.state === "here");
      for (const run of lod?.file.runs || []) {
        const from = Math.max(lod.offset, run.first * columns), to = Math.min(lod.offset + lod.count, (run.first + run.rows) * columns);
        if (from < to) ranges.push(run.row * columns + from - run.first * columns, to - from);
      }
    }
    viewer.ranges = ranges;
    ++viewer.version;
    viewer.request();
  }

  // An order is here: what left before it was asked for is in no picture any more.
  sorted(version) {
    if (version !== this.viewer.version) return;
    for (const file of this.files) {
      if (file.state !== "leaving") continue;
      for (const run of file.runs) for (let k = 0; k < run.rows; ++k) this.free.push(run.row + k);
      new Set(file.chunk.textures).forEach(texture => this.viewer.renderer.gl.deleteTexture(texture));
      this.viewer.renderer.levels[0].chunks.delete(file.chunk);
      file.chunk = file.runs = null;
      file.state = "away";
    }
    this.changed?.();
    this.next();
  }

  // Waits until all that this camera wants is here.
  async settled(camera) {
    this.fixed = camera;
    this.plan();
    if (this.missing) await new Promise(done => this.waiting.push(done));
    this.fixed = null;
  }

  get state() {
    const here = this.files.filter(file => file.state === "here");
    return {budget: this.budget, rows: this.rows, parts: here.map(file => file.name), splats: here.reduce((sum, file) => sum + file.count, 0),
      drawn: (this.viewer.ranges || []).reduce((sum, x, i) => sum + i % 2 * x, 0), missing: this.missing, requests: network.requests, retries: network.retries, cut: network.cut};
  }
}

async function openSplats(viewer) {
  const budget = budgetOfDevice();
  element("facts").textContent += ` Up to ${budget.toLocaleString("en")} splats at a time here (?budget=2M in the address changes that).`;
  await new Stream(viewer, budget).open();
}
