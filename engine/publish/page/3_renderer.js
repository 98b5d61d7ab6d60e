// SPDX-License-Identifier: MIT
// WebGL 2: projects all splats into two textures of integers, then blends a quad a splat, front to back.
const batch = 1024;  // splats an instance

class Renderer {
  constructor(canvas) {
    const gl = canvas.getContext("webgl2", {alpha: false, antialias: false, depth: false, powerPreference: "high-performance"});
    if (!gl) throw Error("this browser or device has no WebGL 2");
    this.gl = gl;
    this.canvas = canvas;
    const most = gl.getParameter(gl.MAX_TEXTURE_SIZE);
    this.columns = Math.min(2048, most);
    this.most = most * this.columns;
    if (scene.columns && scene.count > this.most) throw Error(`${scene.count} splats are too many for this device, which takes ${this.most}`);
    const float = gl.getExtension("EXT_color_buffer_float"), half = float || gl.getExtension("EXT_color_buffer_half_float");
    const whole = float && gl.getExtension("EXT_float_blend");
    this.formats = {float32: whole && gl.RGBA32F, float16: half && gl.RGBA16F, unorm8: gl.RGBA8};
    this.smooth = gl.getExtension("OES_texture_float_linear");
    this.coarse = !half;
    this.project = this.program("corner.vert", "project.frag");
    this.blend = this.program("splat.vert", "splat.frag");
    this.show = this.program("corner.vert", "show.frag");
    this.levels = [];  // of splats: all, then fewer
    this.targets = new Map();
    this.nothing = gl.createVertexArray();
    this.quads = this.quadsOfBatch();
  }

  program(vertex, fragment) {
    const gl = this.gl, program = gl.createProgram();
    const shaders = [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]].map(([kind, name]) => {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, scene.shaders[name]);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
      return [shader, name];
    });
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS) && !gl.isContextLost())
      throw Error([...shaders.map(([s, name]) => name + ": " + gl.getShaderInfoLog(s)), gl.getProgramInfoLog(program)].join("\n"));
    const at = {};
    return {use: () => gl.useProgram(program), at: name => at[name] ??= gl.getUniformLocation(program, name)};
  }

  texture(target, format, width, height, depth) {
    const gl = this.gl, texture = gl.createTexture();
    gl.bindTexture(target, texture);
    for (const p of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(target, p, gl.NEAREST);
    for (const p of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(target, p, gl.CLAMP_TO_EDGE);
    if (depth) gl.texStorage3D(target, 1, format, width, height, depth);
    else gl.texStorage2D(target, 1, format, width, height);
    return texture;
  }

  framebuffer(textures) {
    const gl = this.gl, framebuffer = gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
    textures.forEach((t, i) => gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0 + i, gl.TEXTURE_2D, t, 0));
    gl.drawBuffers(textures.map((_, i) => gl.COLOR_ATTACHMENT0 + i));
    if (gl.checkFramebufferStatus(gl.FRAMEBUFFER) !== gl.FRAMEBUFFER_COMPLETE) {
      gl.deleteFramebuffer(framebuffer);
      return null;
    }
    return framebuffer;
  }

  // Whole rows, then what the last one holds.
  fill(values, width, upload) {
    const count = values.length / width, rows = Math.floor(count / this.columns), rest = count % this.columns;
    if (rows) upload(0, this.columns, rows, values.subarray(0, rows * this.columns * width));
    if (rest) upload(rows, rest, 1, values.subarray(rows * this.columns * width));
  }

  quadsOfBatch() {
    const gl = this.gl, quads = gl.createVertexArray(), corners = [0, 1, 2, 2, 1, 3];
    gl.bindVertexArray(quads);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, Uint16Array.from({length: 6 * batch}, (_, i) => 4 * Math.floor(i / 6) + corners[i % 6]), gl.STATIC_DRAW);
    return quads;
  }

  // layers: of four words a splat.
  upload({layers}) {
    const gl = this.gl, rows = Math.max(1, Math.ceil(layers[0].length / 4 / this.columns)), level = {rows, count: 0};  // count: of the order
    level.words = this.texture(gl.TEXTURE_2D_ARRAY, gl.RGBA32UI, this.columns, rows, layers.length);
    layers.forEach((layer, k) => this.fill(layer, 4, (row, width, height, values) =>
      gl.texSubImage3D(gl.TEXTURE_2D_ARRAY, 0, 0, row, k, width, height, 1, gl.RGBA_INTEGER, gl.UNSIGNED_INT, values)));
    this.finishLevel(level);
  }

  // One level is drawn at a time: the later ones, which are smaller, share what the first is projected into.
  finishLevel(level) {
    const gl = this.gl, {projected, projection, order} = this.levels[0] || {};
    const formats = [gl.RGBA32UI, gl.RGBA32UI, ...scene.shaped ? [gl.R32UI] : []];
    level.projected = projected || formats.map(format => this.texture(gl.TEXTURE_2D, format, this.columns, level.rows));
    level.projection = projection || this.framebuffer(level.projected);
    level.order = order || this.texture(gl.TEXTURE_2D, gl.R32UI, this.columns, level.rows);
    const failure = gl.getError();
    if (failure) throw Error(failure === gl.OUT_OF_MEMORY ? `${level.rows * this.columns} splats do not fit into the memory of this device` : `WebGL error ${failure}`);
    this.levels.push(level);
  }

  setOrder(order, at) {
    const gl = this.gl, level = this.levels[at];
    gl.bindTexture(gl.TEXTURE_2D, level.order);
    this.fill(order, 1, (row, width, height, values) =>
      gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, row, width, height, gl.RED_INTEGER, gl.UNSIGNED_INT, values));
    level.count = order.length;
  }

  // The target that is blended into, of the finest format that the device can blend; at rest in full precision.
  target(width, height, fine) {
    const held = this.targets.get(fine), gl = this.gl;
    if (held?.width === width && held.height === height) return held;
    if (held) { gl.deleteTexture(held.texture); gl.deleteFramebuffer(held.framebuffer); }
    for (const name of fine ? ["float32", "float16", "unorm8"] : ["float16", "unorm8"]) {
      if (!this.formats[name]) continue;
      const texture = this.texture(gl.TEXTURE_2D, this.formats[name], width, height);
      if (name !== "float32" || this.smooth)
        for (const p of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, p, gl.LINEAR);
      const framebuffer = this.framebuffer([texture]);
      if (framebuffer) {
        const target = {width, height, name, texture, framebuffer};
        this.targets.set(fine, target);
        return target;
      }
      gl.deleteTexture(texture);
    }
    throw Error(`a picture of ${width}x${height} does not fit`);
  }

  setCamera(program, camera) {
    const gl = this.gl, at = name => program.at("camera." + name);
    const centre = camera.eye.map(Math.fround);
    camera.axes.forEach((row, i) => gl.uniform3fv(at("row" + i), row));
    gl.uniform3fv(at("centre"), centre);
    gl.uniform3fv(at("centre_rest"), camera.eye.map((x, i) => x - centre[i]));
    gl.uniform2f(at("focal"), camera.fx, camera.fy);
    gl.uniform2f(at("principal"), camera.cx, camera.cy);
    const x = scene.jacobianMargin * 0.5 * camera.width / camera.fx, y = scene.jacobianMargin * 0.5 * camera.height / camera.fy;
    gl.uniform2f(at("ratio_min"), -camera.cx / camera.fx - x, -camera.cy / camera.fy - y);
    gl.uniform2f(at("ratio_max"), (camera.width - camera.cx) / camera.fx + x, (camera.height - camera.cy) / camera.fy + y);
    gl.uniform1ui(at("width"), camera.width);
    gl.uniform1ui(at("height"), camera.height);
    gl.uniform1f(at("near_plane"), scene.near);
    gl.uniform1f(program.at("low_pass"), scene.lowPass);
  }

  bind(program, names, textures, target = this.gl.TEXTURE_2D) {
    names.forEach((name, i) => {
      this.gl.activeTexture(this.gl.TEXTURE0 + i);
      this.gl.bindTexture(target, textures[i]);
      this.gl.uniform1i(program.at(name), i);
    });
  }

  pass(framebuffer, width, height, program) {
    this.gl.bindFramebuffer(this.gl.FRAMEBUFFER, framebuffer);
    this.gl.viewport(0, 0, width, height);
    program.use();
  }

  // Waits until all is drawn.
  finish() {
    this.gl.readPixels(0, 0, 1, 1, this.gl.RGBA, this.gl.UNSIGNED_BYTE, new Uint8Array(4));
  }

  projectSplats(level) {
    const gl = this.gl;
    this.bind(this.project, ["words"], [level.words], gl.TEXTURE_2D_ARRAY);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }

  draw(camera, fine, at = 0) {
    const gl = this.gl, {width, height} = camera, target = this.target(width, height, fine), level = this.levels[at];
    gl.disable(gl.BLEND);
    gl.bindVertexArray(this.nothing);
    this.pass(level.projection, this.columns, level.rows, this.project);
    this.setCamera(this.project, camera);
    if (level.chunks) projectChunks(this, level);
    else this.projectSplats(level);

    this.pass(target.framebuffer, width, height, this.blend);
    gl.clearColor(0, 0, 0, 1);
    gl.clear(gl.COLOR_BUFFER_BIT);
    gl.enable(gl.BLEND);
    gl.blendFuncSeparate(gl.DST_ALPHA, gl.ONE, gl.ZERO, gl.ONE_MINUS_SRC_ALPHA);
    gl.bindVertexArray(this.quads);
    this.bind(this.blend, ["order", "shapes", "lights", "exponents"].slice(0, level.projected.length + 1), [level.order, ...level.projected]);
    gl.uniform1i(this.blend.at("batch"), batch);
    gl.uniform1i(this.blend.at("count"), level.count);
    gl.uniform2f(this.blend.at("frame"), width, height);
    if (level.count) gl.drawElementsInstanced(gl.TRIANGLES, 6 * batch, gl.UNSIGNED_SHORT, 0, Math.ceil(level.count / batch));

    gl.disable(gl.BLEND);
    gl.bindVertexArray(this.nothing);
    this.pass(null, this.canvas.width, this.canvas.height, this.show);
    this.bind(this.show, ["blended"], [target.texture]);
    gl.uniform3fv(this.show.at("background"), scene.background);
    gl.uniform2f(this.show.at("window"), this.canvas.width, this.canvas.height);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    return target.name;
  }
}
