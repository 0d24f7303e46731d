// SPDX-License-Identifier: Apache-2.0
// The viewer's renderer: unpacks fragments and draws them with WebGL 2.
"use strict";
const view = JSON.parse(document.getElementById("view").textContent);
const element = id => document.getElementById(id);
const canvas = element("picture"), slider = element("layers"), only = element("only"), select = element("channel");
const layers = Math.max(1, view.layerEnds.length);
const layerEnd = k => view.layerEnds[k - 1] ?? 0;  // number of fragments in the k front layers

const many = n => n.toLocaleString("en");
const rounded = z => Number(z.toPrecision(4)).toLocaleString("en", { maximumFractionDigits: 20 });

// The channels. The ramps are matplotlib's inferno and viridis (CC0), in eight steps.
const channels = {
  color: { name: "Colour" },
  alpha: { name: "Alpha", low: "0", ramp: ["000000", "ffffff"], high: "1" },
  depth: { name: "Depth", low: "near " + rounded(view.depths[0]), high: "far " + rounded(view.depths[1]),
    ramp: ["fcffa4", "f9cb35", "f98e09", "e45a31", "bc3754", "8a226a", "57106e", "210c4a"] },
  layer: { name: "Layer", low: "0", high: many(layers - 1),
    ramp: ["fde725", "a0da39", "4ac16d", "1fa187", "277f8e", "365c8d", "46327e", "440154"] },
  object: { name: "Object", low: many(Object.keys(view.objects ?? {}).length) + " objects, one colour each" },
  normal: { name: "Normal", low: "red to the right, green up, blue towards you" },
};
if (!view.objects) delete channels.object;

// Unpacks the fragments, which are ordered by layer, front to back, then by row. The writer packs
// them in byte planes. Each value is stored as the difference from a prediction, which is made from
// the previous fragment or from the fragment's own corners.
async function unpack() {
  const text = element("fragments").textContent;
  const packed = Uint8Array.from(atob(text), c => c.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  const planes = new Uint8Array(await new Response(stream).arrayBuffer());
  const count = view.layerEnds.at(-1) ?? 0;
  const colors = view.tinted ? 7 : 4;  // R, G, B, A, and the opacity of each channel
  const own = 12 + colors;  // plane of the fragment's own depth, before the planes of the ids
  const names = [view.objects, view.materials];
  if (planes.length !== (own + 2 + 4 * names.filter(Boolean).length) * count)
    throw new Error("the page is damaged: " + planes.length + " bytes");
  // Each fragment is one texel: pixel; upper corners; lower corners; colour.
  const rows = Math.max(1, Math.ceil(count / 2048));
  const texels = new Uint32Array(4 * 2048 * rows);
  const value16 = (plane, i) => planes[plane * count + i] | planes[(plane + 1) * count + i] << 8;
  const value32 = (plane, i) => value16(plane, i) | value16(plane + 2, i) << 16;
  let pixel = 0, upperLeft = 0, upperRight = 0, lowerRight = 0, rise = 0, color = new Array(colors).fill(0);
  const opacities = view.tinted ? new Uint32Array(2048 * rows) : null;
  const depths = new Uint16Array(count);
  for (let i = 0; i < count; ++i) {
    pixel = (pixel + value32(0, i)) >>> 0;
    upperLeft = upperRight + value16(4, i) & 0xffff;
    const lowerLeft = lowerRight + value16(6, i) & 0xffff;
    rise = rise + value16(8, i) & 0xffff;
    upperRight = upperLeft + rise & 0xffff;
    lowerRight = lowerLeft + rise + value16(10, i) & 0xffff;
    for (let c = 0; c < colors; ++c) color[c] = color[c] + planes[(12 + c) * count + i] & 0xff;
    texels[4 * i] = pixel;
    texels[4 * i + 1] = (upperLeft | upperRight << 16) >>> 0;
    texels[4 * i + 2] = (lowerLeft | lowerRight << 16) >>> 0;
    texels[4 * i + 3] = (color[0] | color[1] << 8 | color[2] << 16 | color[3] << 24) >>> 0;
    if (opacities) opacities[i] = color[4] | color[5] << 8 | color[6] << 16;
    depths[i] = (upperLeft + upperRight + lowerLeft + lowerRight + 2 >> 2) + value16(own, i);
  }
  let plane = own + 2;
  const [objects, materials] = names.map(given => {
    if (!given) return null;
    const ids = new Uint32Array(2048 * rows);
    for (let i = 0; i < count; ++i) ids[i] = (i ? ids[i - 1] : 0) + value32(plane, i);
    plane += 4;
    return ids;
  });
  return { count, rows, texels, opacities, depths, objects, materials };
}
const zOf = code => {
  const measure = view.range[0] + code / 65535 * (view.range[1] - view.range[0]);
  return view.perspective ? 2 ** measure : measure;
};
// Half a step of the depth codes; for a perspective camera, relative to Z.
const halfStep = (view.range[1] - view.range[0]) / 65535 / 2 * (view.perspective ? Math.LN2 : 1);

const head = "#version 300 es\nprecision highp float;\nprecision highp int;\nprecision highp usampler2D;\n" +
  ["color", "alpha", "depth", "layer", "object", "normal"].map((name, i) => {
    if (channels[name]) channels[name].index = i;
    return "const int k" + name + " = " + i + ";\n";
  }).join("");
const cellShader = head + `
uniform usampler2D fragments;
uniform usampler2D more;  // per fragment: opacity of each channel, or its object
uniform int channel;  // index of the shown channel
uniform int through;  // colour channel whose opacity becomes alpha; -1: the common alpha
uniform int first;  // index of the first fragment; -1: use the list id
uniform mat4 toCamera;      // from the captured camera's space
uniform vec4 frame;  // size of the captured picture, half extents of its frustum
uniform vec2 sample_;
uniform ivec3 window_;      // upper left corner, width
uniform vec2 range;         // of depth codes: log2 Z, or Z
uniform vec2 half_;  // half extents of the current frustum
uniform vec2 depths;        // near and far
uniform bool perspective;
layout(location = 0) in uint id;
flat out uint fragment;
flat out vec4 color;
out float depth;
vec3 pointAt(uvec4 f, int corner) {  // upper left, upper right, lower left, lower right
  uint pair = corner < 2 ? f.y : f.z;
  float code = float((corner & 1) == 0 ? pair & 0xffffu : pair >> 16);
  float z = mix(range.x, range.y, code / 65535.0);
  if (perspective) z = exp2(z);
  vec2 pixel = vec2(window_.xy + ivec2(int(f.x) % window_.z, int(f.x) / window_.z)) + sample_ +
               vec2(corner & 1, corner >> 1) - 0.5;
  vec2 at = (2.0 * pixel / frame.xy - 1.0) * frame.zw * vec2(1, -1);
  return (toCamera * vec4(perspective ? at * z : at, -z, 1)).xyz;
}
vec3 normalOf(uvec4 f, vec3 point) {  // from the cell's diagonals, facing the viewer
  vec3 n = normalize(cross(pointAt(f, 1) - pointAt(f, 2), pointAt(f, 0) - pointAt(f, 3)));
  return dot(n, perspective ? point : vec3(0, 0, -1)) > 0.0 ? -n : n;
}
vec3 colorOf(uint object) {  // hues a golden angle apart, in three strengths; object 0 is grey
  float hue = float(object * 2654435769u >> 8) / 16777216.0;
  vec3 full = clamp(abs(fract(hue + vec3(0, 2, 1) / 3.0) * 6.0 - 3.0) - 1.0, 0.0, 1.0);
  return object == 0u ? vec3(0.5) : mix(vec3(1), full, 0.7) * (1.0 - 0.2 * float(object % 3u));
}
vec3 linear(vec3 c) { return mix(c / 12.92, pow((c + 0.055) / 1.055, vec3(2.4)), step(0.04045, c)); }
void main() {
  fragment = first < 0 ? id : uint(first + gl_InstanceID);
  ivec2 place = ivec2(fragment & 2047u, fragment >> 11);
  uvec4 f = texelFetch(fragments, place, 0);
  vec3 point = pointAt(f, gl_VertexID);
  depth = -point.z;
  float w = perspective ? depth : 1.0;
  float n = depths.x, r = depths.y;
  float d = perspective ? ((r + n) * depth - 2.0 * r * n) / (r - n) : (2.0 * depth - r - n) / (r - n);
  gl_Position = vec4(point.xy / half_, d, w);
  color = vec4(f.w & 0xffu, f.w >> 8 & 0xffu, f.w >> 16 & 0xffu, f.w >> 24) / 255.0;
  if (first >= 0 && f.w == 0u) gl_Position = vec4(2, 2, 2, 1);  // invisible: contributes nothing to the picture
  if (through >= 0) color.a = float(texelFetch(more, place, 0).r >> (8 * through) & 0xffu) / 255.0;
  if (channel == kcolor) color.rgb = linear(color.rgb);
  if (channel == kalpha) color.rgb = color.aaa;
  if (channel == kobject) color = vec4(colorOf(texelFetch(more, place, 0).r), 1);
  if (channel == knormal) color = vec4(0.5 + 0.5 * normalOf(f, point), 1);
}`;
const colorShader = head + `
uniform int channel;
uniform vec2 shownDepths;
uniform float layer;     // 0 to 1, front to back
uniform vec3 steps[8];   // of the ramp
flat in vec4 color;
in float depth;
out vec4 result;
void main() {
  result = color;
  if (channel != kdepth && channel != klayer) return;
  float t = channel == klayer ? layer : (depth - shownDepths.x) / (shownDepths.y - shownDepths.x);
  float at = 7.0 * clamp(t, 0.0, 1.0);
  int low = min(int(at), 6);
  result = vec4(mix(steps[low], steps[low + 1], at - float(low)), 1);
}`;
const nearestShader = head + `
flat in uint fragment;
out uint result;
void main() { result = fragment + 1u; }`;
const coverShader = `#version 300 es
void main() { gl_Position = vec4(gl_VertexID == 1 ? 3 : -1, gl_VertexID == 2 ? 3 : -1, 0, 1); }`;
const encodeShader = `#version 300 es
precision highp float;
uniform sampler2D light;
uniform vec3 background;
uniform bool coded;  // the channel is not light
out vec4 result;
void main() {
  vec4 sum = texelFetch(light, ivec2(gl_FragCoord.xy), 0);
  vec3 c = clamp(sum.rgb + (1.0 - sum.a) * background, 0.0, 1.0);
  result = vec4(coded ? c : mix(12.92 * c, 1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055, step(0.0031308, c)), 1);
}`;

function fail(message) {
  element("failure").textContent = message;
  element("failure").hidden = false;
}

function program(gl, vertex, fragment) {
  const result = gl.createProgram();
  for (const [type, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(type);
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
    gl.attachShader(result, shader);
  }
  gl.linkProgram(result);
  if (!gl.getProgramParameter(result, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(result));
  const uniforms = {};
  for (let i = 0; i < gl.getProgramParameter(result, gl.ACTIVE_UNIFORMS); ++i) {
    const name = gl.getActiveUniform(result, i).name;
    uniforms[name] = gl.getUniformLocation(result, name);
  }
  return { result, uniforms };
}

// Column-major 4 x 4 matrices.
function times(a, b) {
  const m = new Float32Array(16);
  for (let c = 0; c < 4; ++c)
    for (let r = 0; r < 4; ++r)
      for (let k = 0; k < 4; ++k) m[4 * c + r] += a[4 * k + r] * b[4 * c + k];
  return m;
}
const shift = (x, y, z) => new Float32Array([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, x, y, z, 1]);
function turn(angle, [x, y, z]) {
  const c = Math.cos(angle), s = Math.sin(angle), d = 1 - c;
  return new Float32Array([x * x * d + c, y * x * d + z * s, z * x * d - y * s, 0,
    x * y * d - z * s, y * y * d + c, z * y * d + x * s, 0,
    x * z * d + y * s, y * z * d - x * s, z * z * d + c, 0, 0, 0, 0, 1]);
}

// Creates the renderer. A look is { camera: a matrix, half: half extents of the frustum, near, far,
// from, to: range of layers, channel }.
function renderer({ count, rows, texels, opacities, objects }) {
  const gl = canvas.getContext("webgl2", { alpha: false, antialias: false, preserveDrawingBuffer: true });
  if (!gl) throw new Error("this browser does not offer WebGL 2");
  const floats = gl.getExtension("EXT_color_buffer_float") || gl.getExtension("EXT_color_buffer_half_float");
  const format = floats ? gl.RGBA16F : gl.SRGB8_ALPHA8;  // both blend in linear light
  const samples = Math.min(4, gl.getInternalformatParameter(gl.RENDERBUFFER, format, gl.SAMPLES)[0] ?? 0);
  const cells = program(gl, cellShader, colorShader), encode = program(gl, coverShader, encodeShader);
  const ids = program(gl, cellShader, nearestShader);

  if (rows > gl.getParameter(gl.MAX_TEXTURE_SIZE)) throw new Error("this device has no texture large enough for all fragments");
  canvas.addEventListener("webglcontextlost", () => fail("The graphics device was lost: reload the page."));

  // Creates an integer texture. It must not be filtered, or it would be incomplete.
  const storage = (kind, width, height) => {
    const made = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, made);
    gl.texStorage2D(gl.TEXTURE_2D, 1, kind, width, height);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
    return made;
  };
  const texture = storage(gl.RGBA32UI, 2048, rows);
  gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, 2048, rows, gl.RGBA_INTEGER, gl.UNSIGNED_INT, texels);
  const extra = values => {
    const made = storage(gl.R32UI, values ? 2048 : 1, values ? rows : 1);
    if (values) gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, 2048, rows, gl.RED_INTEGER, gl.UNSIGNED_INT, values);
    return made;
  };
  const opacityTexture = extra(opacities), objectTexture = extra(objects);

  // Opaque fragments use the depth test. The others are sorted again for every view and blended
  // back to front.
  const opaque = [], clear = [];
  for (let i = 0; i < count; ++i) (texels[4 * i + 3] >>> 24 === 255 ? opaque : clear).push(i);
  const buffer = ids => {
    const made = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, made);
    gl.bufferData(gl.ARRAY_BUFFER, ids, gl.DYNAMIC_DRAW);
    return made;
  };
  gl.vertexAttribI4ui(0, 0, 0, 0, 0);  // the fragment's id if there is no list; must be an integer
  const opaqueBuffer = buffer(new Uint32Array(opaque)), clearBuffer = buffer(new Uint32Array(clear));
  const centers = new Float32Array(3 * clear.length);
  clear.forEach((id, i) => {
    const word = k => texels[4 * id + k];
    const z = zOf(((word(1) & 0xffff) + (word(1) >>> 16) + (word(2) & 0xffff) + (word(2) >>> 16)) / 4);
    const x = view.window[0] + word(0) % view.window[2] + view.sample[0];
    const y = view.window[1] + Math.floor(word(0) / view.window[2]) + view.sample[1];
    const scale = view.perspective ? z : 1;
    centers.set([(2 * x / view.width - 1) * view.half[0] * scale, (1 - 2 * y / view.height) * view.half[1] * scale, -z], 3 * i);
  });
  const depths = new Float32Array(clear.length), sorted = new Uint32Array(clear.length);
  const buckets = new Uint32Array(65537);
  const before = (ids, end) => {  // returns how many ids of a rising list are below `end`
    let low = 0, high = ids.length;
    while (low < high) {
      const middle = low + high >> 1;
      if (ids[middle] < end) low = middle + 1; else high = middle;
    }
    return low;
  };
  function sortClear(m, from, to) {
    let near = Infinity, far = -Infinity;
    for (let i = from; i < to; ++i) {
      const z = -(m[2] * centers[3 * i] + m[6] * centers[3 * i + 1] + m[10] * centers[3 * i + 2] + m[14]);
      depths[i] = z;
      if (z < near) near = z;
      if (z > far) far = z;
    }
    const scale = 65535 / Math.max(far - near, 1e-30);
    const key = i => 65535 - Math.trunc((depths[i] - near) * scale);  // the farthest get the lowest keys
    buckets.fill(0);
    for (let i = from; i < to; ++i) ++buckets[key(i) + 1];
    for (let k = 0; k < 65536; ++k) buckets[k + 1] += buckets[k];
    // At equal depth, a fragment of a rear layer comes before one of a front layer.
    for (let i = to - 1; i >= from; --i) sorted[buckets[key(i)]++] = clear[i];
  }

  let target = null;
  function resize() {
    const width = Math.max(1, Math.round(canvas.clientWidth * devicePixelRatio));
    const height = Math.max(1, Math.round(width * view.height / view.width));
    if (target && canvas.width === width && canvas.height === height) return;
    canvas.width = width;
    canvas.height = height;
    if (target) {
      for (const b of target.buffers) gl.deleteRenderbuffer(b);
      for (const f of [target.drawn, target.resolved]) gl.deleteFramebuffer(f);
      gl.deleteTexture(target.light);
    }
    const made = (attachment, kind) => {
      const b = gl.createRenderbuffer();
      gl.bindRenderbuffer(gl.RENDERBUFFER, b);
      gl.renderbufferStorageMultisample(gl.RENDERBUFFER, samples, kind, width, height);
      gl.framebufferRenderbuffer(gl.FRAMEBUFFER, attachment, gl.RENDERBUFFER, b);
      return b;
    };
    const drawn = gl.createFramebuffer(), resolved = gl.createFramebuffer(), light = storage(format, width, height);
    gl.bindFramebuffer(gl.FRAMEBUFFER, drawn);
    const buffers = [made(gl.COLOR_ATTACHMENT0, format), made(gl.DEPTH_ATTACHMENT, gl.DEPTH_COMPONENT24)];
    gl.bindFramebuffer(gl.FRAMEBUFFER, resolved);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, light, 0);
    target = { drawn, resolved, light, buffers };
  }

  // Sets up a program for drawing the fragments. Returns its uniforms.
  function use({ result, uniforms: u }, look) {
    gl.useProgram(result);
    gl.uniformMatrix4fv(u.toCamera, false, look.camera);
    gl.uniform4f(u.frame, view.width, view.height, ...view.half);
    gl.uniform2f(u.sample_, ...view.sample);
    gl.uniform3i(u.window_, ...view.window);
    gl.uniform2f(u.range, ...view.range);
    gl.uniform2f(u.half_, ...look.half);
    gl.uniform2f(u.depths, look.near, look.far);
    gl.uniform1i(u.perspective, view.perspective);
    gl.uniform1i(u.channel, channels[look.channel].index);
    gl.uniform1i(u.through, -1);
    gl.uniform1i(u.more, 1);
    gl.activeTexture(gl.TEXTURE1);
    gl.bindTexture(gl.TEXTURE_2D, look.channel === "object" ? objectTexture : opacityTexture);
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.enable(gl.DEPTH_TEST);
    gl.depthFunc(gl.LESS);
    gl.depthMask(true);
    gl.disable(gl.BLEND);
    return u;
  }

  // Draws all cells. At equal depth, the cell of the front layer wins.
  function drawNearest(u, { from, to }) {
    for (let k = from; k < to; ++k) {
      gl.uniform1f(u.layer, k / Math.max(1, layers - 1));
      gl.uniform1i(u.first, layerEnd(k));
      gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, layerEnd(k + 1) - layerEnd(k));
    }
  }

  // Draws opaque cells with the depth test, then blends the others over them.
  function drawBlended(u, { camera, from, to }) {
    const cellsOf = (list, begin, end) => {
      if (begin === end) return;
      gl.bindBuffer(gl.ARRAY_BUFFER, list);
      gl.vertexAttribIPointer(0, 1, gl.UNSIGNED_INT, 0, 4 * begin);
      gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, end - begin);
    };
    gl.uniform1i(u.first, -1);
    gl.enableVertexAttribArray(0);
    gl.vertexAttribDivisor(0, 1);
    cellsOf(opaqueBuffer, before(opaque, layerEnd(from)), before(opaque, layerEnd(to)));
    const begin = before(clear, layerEnd(from)), end = before(clear, layerEnd(to));
    sortClear(camera, begin, end);
    gl.bindBuffer(gl.ARRAY_BUFFER, clearBuffer);
    gl.bufferSubData(gl.ARRAY_BUFFER, 0, sorted, 0, end - begin);
    gl.depthMask(false);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    for (let c = 0; c < (opacities ? 3 : 1); ++c) {  // the opacity of coloured glass differs by channel
      if (opacities) {
        gl.uniform1i(u.through, c);
        gl.colorMask(c === 0, c === 1, c === 2, false);
      }
      cellsOf(clearBuffer, 0, end - begin);
    }
    gl.colorMask(true, true, true, true);
    gl.depthMask(true);
    gl.disable(gl.BLEND);
    gl.disableVertexAttribArray(0);
  }

  function draw(look) {
    resize();
    const light = look.channel === "color", blended = light || look.channel === "alpha";
    const background = light ? view.background : [0, 0, 0];
    gl.bindFramebuffer(gl.FRAMEBUFFER, target.drawn);
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clearColor(...(opacities && blended ? [...background, 1] : [0, 0, 0, 0]));  // with coloured opacity, the background is blended in here
    gl.depthMask(true);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const u = use(cells, look);
    gl.uniform2f(u.shownDepths, ...view.depths);
    const steps = channels[look.channel].ramp;
    if (steps?.length === 8)
      gl.uniform3fv(u["steps[0]"], steps.flatMap(s => [0, 2, 4].map(i => parseInt(s.slice(i, i + 2), 16) / 255)));
    (blended ? drawBlended : drawNearest)(u, look);
    gl.disable(gl.DEPTH_TEST);

    gl.bindFramebuffer(gl.READ_FRAMEBUFFER, target.drawn);
    gl.bindFramebuffer(gl.DRAW_FRAMEBUFFER, target.resolved);
    gl.blitFramebuffer(0, 0, canvas.width, canvas.height, 0, 0, canvas.width, canvas.height, gl.COLOR_BUFFER_BIT, gl.NEAREST);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.useProgram(encode.result);
    gl.uniform3f(encode.uniforms.background, ...background);
    gl.uniform1i(encode.uniforms.coded, !light);
    gl.bindTexture(gl.TEXTURE_2D, target.light);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    canvas.dataset.frame = 1 + Number(canvas.dataset.frame ?? 0);
  }

  // A render target of one pixel, which receives the id of a fragment.
  const one = gl.createFramebuffer(), oneDepth = gl.createRenderbuffer(), oneNumber = storage(gl.R32UI, 1, 1);
  gl.bindRenderbuffer(gl.RENDERBUFFER, oneDepth);
  gl.renderbufferStorage(gl.RENDERBUFFER, gl.DEPTH_COMPONENT24, 1, 1);
  gl.bindFramebuffer(gl.FRAMEBUFFER, one);
  gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, oneNumber, 0);
  gl.framebufferRenderbuffer(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.RENDERBUFFER, oneDepth);

  // Returns the index of the nearest fragment at a position in the picture (0 to 1 in both
  // directions); -1 if there is none.
  function nearest(look, x, y) {
    gl.bindFramebuffer(gl.FRAMEBUFFER, one);
    const pixel = (at, size) => Math.min(size - 1, Math.floor(at * size + 1e-3));
    gl.viewport(-pixel(x, canvas.width), 1 + pixel(y, canvas.height) - canvas.height, canvas.width, canvas.height);
    const u = use(ids, look), found = new Uint32Array(4);
    gl.clearBufferuiv(gl.COLOR, 0, found);
    gl.clearBufferfv(gl.DEPTH, 0, [1]);
    drawNearest(u, look);
    gl.disable(gl.DEPTH_TEST);
    gl.readPixels(0, 0, 1, 1, gl.RGBA_INTEGER, gl.UNSIGNED_INT, found);
    return found[0] - 1;
  }
  return { draw, nearest };
}

