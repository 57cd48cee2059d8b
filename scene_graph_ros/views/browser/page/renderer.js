// Draws bodies, planes and contacts with WebGL 2.

import { FORMS, SMALL, SMALL_PIXELS } from "./forms.js";
import { BODY, PICK, PLANE, SURFACE } from "./shaders.js";
import { dot, minus, plus, turn } from "./vectors.js";

const FLOATS = 15;  // of a body: position 3, rotation 4, stretch 4, color 4
const LAYOUT = [[3, 3], [4, 4], [5, 4], [6, 4]];  // locations and sizes of these
const PAINT = 7;  // the location of a corner's own color; of forms without it is nothing
const COVER = 8;  // that of its place on a picture

// Tells whether a processor draws instead of a graphics processor: smooth edges, four samples for
// each pixel, take it three times as long then.
function isSoftware() {
  const gl = document.createElement("canvas").getContext("webgl2");
  const name = gl?.getExtension("WEBGL_debug_renderer_info");
  const isOne = Boolean(name)
    && /swiftshader|llvmpipe|softpipe|basic render/i.test(gl.getParameter(name.UNMASKED_RENDERER_WEBGL));
  gl?.getExtension("WEBGL_lose_context")?.loseContext();
  return isOne;
}

function program(gl, { vertex, fragment }) {
  const result = gl.createProgram();
  for (const [kind, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    gl.attachShader(result, shader);
  }
  gl.linkProgram(result);
  if (!gl.getProgramParameter(result, gl.LINK_STATUS) && !gl.isContextLost()) {
    throw new Error(`a program does not link: ${gl.getProgramInfoLog(result)}`);
  }
  const uniforms = {};
  for (let k = 0; k < gl.getProgramParameter(result, gl.ACTIVE_UNIFORMS); k++) {
    const { name } = gl.getActiveUniform(result, k);
    uniforms[name] = gl.getUniformLocation(result, name);
  }
  return { program: result, uniforms };
}

// A form in the memory of the graphics processor, with room for many bodies of it.
class Batch {
  constructor(gl, { vertices, triangles, colors, coordinates, parts }) {
    this.gl = gl;
    this.array = gl.createVertexArray();
    this.buffers = Array.from({ length: 5 }, () => gl.createBuffer());
    gl.bindVertexArray(this.array);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffers[0]);
    gl.bufferData(gl.ARRAY_BUFFER, vertices, gl.STATIC_DRAW);
    [[0, 3, 0], [1, 1, 12], [2, 3, 16]].forEach(([location, size, offset]) => {
      gl.enableVertexAttribArray(location);
      gl.vertexAttribPointer(location, size, gl.FLOAT, false, 28, offset);
    });
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffers[1]);
    let offset = 0;
    for (const [location, size] of LAYOUT) {
      gl.enableVertexAttribArray(location);
      gl.vertexAttribPointer(location, size, gl.FLOAT, false, 4 * FLOATS, offset);
      gl.vertexAttribDivisor(location, 1);
      offset += 4 * size;
    }
    if (colors) {
      gl.bindBuffer(gl.ARRAY_BUFFER, this.buffers[3]);
      gl.bufferData(gl.ARRAY_BUFFER, colors, gl.STATIC_DRAW);
      gl.enableVertexAttribArray(PAINT);
      gl.vertexAttribPointer(PAINT, 4, gl.UNSIGNED_BYTE, true, 4, 0);
    }
    if (coordinates) {
      gl.bindBuffer(gl.ARRAY_BUFFER, this.buffers[4]);
      gl.bufferData(gl.ARRAY_BUFFER, coordinates, gl.STATIC_DRAW);
      gl.enableVertexAttribArray(COVER);
      gl.vertexAttribPointer(COVER, 2, gl.FLOAT, false, 8, 0);
    }
    this.isIndexed = triangles !== null;
    this.count = triangles ? triangles.length : vertices.length / 7;
    this.parts = parts ?? [{ texture: 0, begin: 0, count: this.count }];
    if (triangles) {
      gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, this.buffers[2]);
      gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, triangles, gl.STATIC_DRAW);
    }
  }

  // Draws bodies; `cover` is called with the texture of each part.
  draw(numbers, cover) {
    const { gl } = this;
    if (!numbers.length || !this.count) return;
    gl.bindVertexArray(this.array);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffers[1]);
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(numbers), gl.STREAM_DRAW);
    const bodies = numbers.length / FLOATS;
    for (const { texture, begin, count } of this.parts) {
      cover(texture);
      if (this.isIndexed) gl.drawElementsInstanced(gl.TRIANGLES, count, gl.UNSIGNED_INT, 0, bodies);
      else gl.drawArraysInstanced(gl.TRIANGLES, begin, count, bodies);
    }
  }

  free() {
    this.gl.deleteVertexArray(this.array);
    this.buffers.forEach((buffer) => this.gl.deleteBuffer(buffer));
  }
}

export class Renderer {
  constructor(canvas) {
    this.canvas = canvas;
    this.gl = canvas.getContext("webgl2", { antialias: !isSoftware(), alpha: false });
    if (!this.gl) throw new Error("this browser has no WebGL 2");
    const { gl } = this;
    this.body = program(gl, BODY);
    this.pick = program(gl, PICK);
    this.plane = program(gl, PLANE);
    this.surface = program(gl, SURFACE);
    this.triangles = { array: gl.createVertexArray(), corners: gl.createBuffer(),
      pressures: gl.createBuffer() };
    gl.vertexAttrib4f(PAINT, 0, 0, 0, 0);
    this.textures = new Map();
    this.batches = new Map(Object.entries(FORMS).map(([name, form]) => [name, new Batch(gl, form)]));
    this.square = gl.createVertexArray();
    gl.bindVertexArray(this.square);
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array([-1, -1, 1, -1, -1, 1, 1, 1]), gl.STATIC_DRAW);
    gl.enableVertexAttribArray(0);
    gl.vertexAttribPointer(0, 2, gl.FLOAT, false, 0, 0);
  }

  // Takes the form of a mesh, instead of the one of that number before.
  setMesh(number, form) {
    this.dropMesh(number);
    this.batches.set(number, new Batch(this.gl, form));
  }

  dropMesh(number) {
    this.batches.get(number)?.free();
    this.batches.delete(number);
  }

  // Takes a picture, whose rows are from above.
  setTexture(number, image) {
    this.dropTexture(number);
    const { gl } = this, texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, gl.RGBA, gl.UNSIGNED_BYTE, image);
    gl.generateMipmap(gl.TEXTURE_2D);
    this.textures.set(number, texture);
  }

  dropTexture(number) {
    this.gl.deleteTexture(this.textures.get(number) ?? null);
    this.textures.delete(number);
  }

  // Has a program draw with a texture, or without one.
  cover(uniforms, number) {
    const { gl } = this, texture = this.textures.get(number);
    gl.uniform1i(uniforms.u_covered ?? null, texture ? 1 : 0);
    if (texture) gl.bindTexture(gl.TEXTURE_2D, texture);
  }

  // Draws bodies {batch, position, rotation, stretch, color, sheer}, plain ones in their own colour
  // alone, planes {position, rotation, color, texture, repeats} and, seen through all of these,
  // surfaces {origin, corners, pressures, scale} and marks, which are bodies.
  draw(camera, { bodies, plain = [], planes, marks, surfaces }, background) {
    const { gl, canvas } = this;
    const ratio = window.devicePixelRatio || 1;
    const [width, height] = [canvas.clientWidth, canvas.clientHeight].map((n) => Math.round(ratio * n));
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
    gl.viewport(0, 0, width, height);
    gl.clearColor(...background, 1);
    gl.depthMask(true);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const view = camera.view(width / Math.max(height, 1));
    gl.enable(gl.DEPTH_TEST);
    gl.disable(gl.BLEND);
    const isWhole = (body) => body.color[3] >= 1 && !body.sheer;
    this.drawBodies(view, bodies.filter(isWhole));
    this.drawPlain(view, plain.filter(isWhole));
    gl.enable(gl.BLEND);
    gl.blendFuncSeparate(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.depthMask(false);
    planes.forEach((plane) => this.drawPlane(view, plane, camera.distance));
    const veils = bodies.filter((body) => !isWhole(body) && body.color[3] > 0);
    gl.enable(gl.CULL_FACE);
    for (const hidden of [gl.FRONT, gl.BACK]) {
      gl.cullFace(hidden);
      this.drawBodies(view, veils);
      this.drawPlain(view, plain.filter((body) => !isWhole(body)));
    }
    gl.disable(gl.CULL_FACE);
    gl.disable(gl.DEPTH_TEST);
    if (surfaces?.count) this.drawSurfaces(view, surfaces);
    this.drawBodies(view, marks);
  }

  drawPlain(view, bodies) {
    const { gl } = this, { program, uniforms } = this.body;
    gl.useProgram(program);
    gl.uniform1i(uniforms.u_plain, 1);
    this.drawBodies(view, bodies);
    gl.uniform1i(uniforms.u_plain, 0);
  }

  drawSurfaces(view, { count, scale, origin, corners, pressures }) {
    const { gl } = this, { array } = this.triangles;
    gl.useProgram(this.surface.program);
    gl.uniformMatrix4fv(this.surface.uniforms.u_matrix, false, view.matrix);
    gl.uniform3fv(this.surface.uniforms.u_origin, minus(origin, view.eye));
    gl.uniform1f(this.surface.uniforms.u_scale, scale);
    gl.bindVertexArray(array);
    [[this.triangles.corners, corners, 3], [this.triangles.pressures, pressures, 1]].forEach(
      ([buffer, numbers, size], location) => {
        gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
        gl.bufferData(gl.ARRAY_BUFFER, numbers, gl.STREAM_DRAW);
        gl.enableVertexAttribArray(location);
        gl.vertexAttribPointer(location, size, gl.FLOAT, false, 0, 0);
      });
    gl.drawArrays(gl.TRIANGLES, 0, count);
  }

  // Returns which of the bodies is in front at a place of the canvas (in its pixels, from above); -1
  // where none is.
  bodyAt(camera, bodies, x, y) {
    const { gl, canvas } = this, { width, height } = canvas;
    const frame = gl.createFramebuffer();
    const [color, depth] = [gl.createRenderbuffer(), gl.createRenderbuffer()];
    gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
    [[color, gl.RGBA8, gl.COLOR_ATTACHMENT0],
      [depth, gl.DEPTH_COMPONENT24, gl.DEPTH_ATTACHMENT]].forEach(([buffer, kind, place]) => {
      gl.bindRenderbuffer(gl.RENDERBUFFER, buffer);
      gl.renderbufferStorage(gl.RENDERBUFFER, kind, width, height);
      gl.framebufferRenderbuffer(gl.FRAMEBUFFER, place, gl.RENDERBUFFER, buffer);
    });
    const at = [Math.round(x), height - 1 - Math.round(y)];
    gl.viewport(0, 0, width, height);
    gl.enable(gl.SCISSOR_TEST);
    gl.scissor(...at, 1, 1);
    gl.clearColor(0, 0, 0, 0);
    gl.depthMask(true);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    gl.disable(gl.BLEND);
    const numbered = bodies.map((body, k) => ({ ...body, color: asColor(k + 1) }));
    this.drawBodies(camera.view(width / Math.max(height, 1)), numbered, this.pick);
    const seen = new Uint8Array(4);
    gl.readPixels(...at, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, seen);
    gl.disable(gl.SCISSOR_TEST);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.deleteFramebuffer(frame);
    [color, depth].forEach((buffer) => gl.deleteRenderbuffer(buffer));
    return seen[0] + 256 * seen[1] + 65536 * seen[2] - 1;
  }

  drawBodies(view, bodies, { program, uniforms } = this.body) {
    this.gl.useProgram(program);
    this.gl.uniformMatrix4fv(uniforms.u_matrix, false, view.matrix);
    const numbers = new Map(), { eye } = view;
    const few = SMALL_PIXELS * view.tallness / Math.max(this.canvas.height, 1);
    for (const { batch, position, rotation, stretch, color } of bodies) {
      const x = position[0] - eye[0], y = position[1] - eye[1], z = position[2] - eye[2];
      const isSmall = batch in SMALL
        && Math.max(stretch[0], stretch[1], stretch[2]) < few * Math.hypot(x, y, z);
      const form = isSmall ? SMALL[batch] : batch;
      if (!numbers.has(form)) numbers.set(form, []);
      numbers.get(form).push(x, y, z, ...rotation, ...stretch, ...color);
    }
    const cover = (texture) => this.cover(uniforms, texture);
    for (const [batch, rows] of numbers) this.batches.get(batch)?.draw(rows, cover);
  }

  drawPlane(view, { position, rotation, color, texture, repeats = [1, 1] }, distance) {
    const { gl, canvas } = this, { uniforms } = this.plane;
    const [along, across, normal] = [[1, 0, 0], [0, 1, 0], [0, 0, 1]].map((v) => turn(rotation, v));
    const away = minus(view.eye, position), height = dot(away, normal);
    const step = 10 ** Math.floor(Math.log10(Math.max(distance, 1e-9)) - 0.7);
    const start = [along, across].map((axis) => dot(away, axis) % (10 * step));
    gl.useProgram(this.plane.program);
    gl.uniformMatrix4fv(uniforms.u_matrix, false, view.matrix);
    gl.uniform3fv(uniforms.u_foot, plus([0, 0, 0], normal, -height));
    gl.uniform3fv(uniforms.u_along, along);
    gl.uniform3fv(uniforms.u_across, across);
    gl.uniform1f(uniforms.u_extent, 0.5 * view.far);
    gl.uniform1f(uniforms.u_step, step);
    gl.uniform2fv(uniforms.u_start, start);
    gl.uniform1f(uniforms.u_height, height);
    gl.uniform2fv(uniforms.u_pixels, [canvas.width, canvas.height]);
    const tall = 0.5 * view.tallness, wide = tall * canvas.width / Math.max(canvas.height, 1);
    const rays = [[view.right, wide], [view.up, tall], [view.back, -1]];
    gl.uniformMatrix3fv(uniforms.u_rays, false, rays.flatMap(
      ([ray, size]) => [along, across, normal].map((axis) => size * dot(ray, axis))));
    gl.uniform4fv(uniforms.u_color, color);
    gl.uniform2fv(uniforms.u_repeats, repeats);
    gl.uniform2fv(uniforms.u_begin, [along, across].map((axis, k) => (dot(away, axis) * repeats[k]) % 1));
    this.cover(uniforms, texture);
    gl.bindVertexArray(this.square);
    gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
  }
}

// A number as a colour of three bytes.
const asColor = (n) => [(n & 255) / 255, ((n >> 8) & 255) / 255, ((n >> 16) & 255) / 255, 1];
