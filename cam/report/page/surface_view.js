// SPDX-License-Identifier: GPL-3.0-or-later
// The surface and the tools' paths, to be turned with mouse, finger or keys. Plain WebGL 1; without
// it, and in print, the still picture stands in its place.
(function () {
  "use strict";
  const holder = document.getElementById("view");
  if (!holder) return;
  const canvas = holder.querySelector("canvas");
  const gl = canvas.getContext("webgl", { antialias: true, alpha: false });
  if (!gl) {
    holder.classList.add("flat");
    return;
  }
  const data = JSON.parse(document.getElementById("view-data").textContent);

  function words(base64) {  // little-endian 16-bit numbers
    const bytes = atob(base64);
    const out = new Uint16Array(bytes.length / 2);
    for (let i = 0; i < out.length; ++i) {
      out[i] = bytes.charCodeAt(2 * i) | (bytes.charCodeAt(2 * i + 1) << 8);
    }
    return out;
  }

  // ---- Geometry: millimetres around the middle of the lens ----
  const size = Math.max(data.width, data.height);
  const middleZ = 0.5 * (data.low + data.high);
  const place = (x, y, z) => [x - 0.5 * data.width, y - 0.5 * data.height, z - middleZ];

  function surfaceArrays() {
    const columns = data.columns, rows = data.rows;
    const raw = words(data.heights);
    const points = new Float32Array(3 * columns * rows);
    for (let r = 0, k = 0; r < rows; ++r) {
      for (let c = 0; c < columns; ++c, ++k) {
        const z = data.low + (data.high - data.low) * raw[k] / 65535;
        points.set(place(data.width * c / (columns - 1), data.height * r / (rows - 1), z), 3 * k);
      }
    }
    const slopes = new Float32Array(2 * columns * rows);
    const dx = data.width / (columns - 1), dy = data.height / (rows - 1);
    const at = (c, r) => points[3 * (r * columns + c) + 2];
    for (let r = 0; r < rows; ++r) {
      for (let c = 0; c < columns; ++c) {
        const c0 = Math.max(0, c - 1), c1 = Math.min(columns - 1, c + 1);
        const r0 = Math.max(0, r - 1), r1 = Math.min(rows - 1, r + 1);
        slopes[2 * (r * columns + c)] = (at(c1, r) - at(c0, r)) / ((c1 - c0) * dx);
        slopes[2 * (r * columns + c) + 1] = (at(c, r1) - at(c, r0)) / ((r1 - r0) * dy);
      }
    }
    const faces = new Uint16Array(6 * (columns - 1) * (rows - 1));
    for (let r = 0, k = 0; r + 1 < rows; ++r) {
      for (let c = 0; c + 1 < columns; ++c) {
        const a = r * columns + c, d = a + columns;
        faces.set([a, a + 1, d + 1, a, d + 1, d], k);
        k += 6;
      }
    }
    return { points, slopes, faces };
  }

  function pathPoints(path) {
    const raw = words(path.points);
    const points = new Float32Array(raw.length);
    for (let i = 0; i < raw.length; i += 3) {
      const p = [0, 1, 2].map((k) => path.low[k] + (path.high[k] - path.low[k]) * raw[i + k] / 65535);
      points.set(place(p[0], p[1], p[2]), i);
    }
    return points;
  }

  // ---- Programs ----
  function program(vertexText, fragmentText) {
    const made = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, vertexText], [gl.FRAGMENT_SHADER, fragmentText]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      gl.attachShader(made, shader);
    }
    gl.linkProgram(made);
    return made;
  }

  const surfaceProgram = program(
    `attribute vec3 point; attribute vec2 slope; uniform mat4 view; uniform float raise;
     varying vec2 lean; varying float level;
     void main() { lean = slope * raise; level = point.z;
       gl_Position = view * vec4(point.xy, point.z * raise, 1.0); }`,
    `precision mediump float; varying vec2 lean; varying float level; uniform vec2 range;
     void main() {
       vec3 n = normalize(vec3(-lean, 1.0));
       float light = 0.1 + 0.9 * max(0.0, dot(n, normalize(vec3(-0.6, 0.6, 0.75))));
       float t = clamp((level - range.x) / max(1e-6, range.y - range.x), 0.0, 1.0);
       gl_FragColor = vec4(mix(vec3(0.55, 0.62, 0.72), vec3(0.98, 0.97, 0.93), t) * light, 1.0); }`);
  const lineProgram = program(
    `attribute vec3 point; uniform mat4 view; uniform float raise;
     void main() { gl_Position = view * vec4(point.xy, point.z * raise, 1.0);
       gl_Position.z -= 0.0015 * gl_Position.w; }`,
    `precision mediump float; uniform vec3 color; void main() { gl_FragColor = vec4(color, 0.55); }`);

  function buffer(target, values) {
    const made = gl.createBuffer();
    gl.bindBuffer(target, made);
    gl.bufferData(target, values, gl.STATIC_DRAW);
    return made;
  }
  function bind(owner, name, made, width) {
    const where = gl.getAttribLocation(owner, name);
    gl.bindBuffer(gl.ARRAY_BUFFER, made);
    gl.enableVertexAttribArray(where);
    gl.vertexAttribPointer(where, width, gl.FLOAT, false, 0, 0);
  }

  const arrays = surfaceArrays();
  const surface = {
    points: buffer(gl.ARRAY_BUFFER, arrays.points),
    slopes: buffer(gl.ARRAY_BUFFER, arrays.slopes),
    faces: buffer(gl.ELEMENT_ARRAY_BUFFER, arrays.faces),
    count: arrays.faces.length,
  };
  const paths = data.paths.map((path) => {
    const points = pathPoints(path);
    return { color: path.color, shown: true, points: buffer(gl.ARRAY_BUFFER, points), strips: path.strips };
  });

  // ---- Camera ----
  const start = { turn: -0.6, tilt: 0.85, distance: 2.05 * size, x: 0, y: 0 };
  let camera = Object.assign({}, start);
  let raise = 1;
  let showSurface = true;

  function multiply(a, b) {  // column by column
    const out = new Float32Array(16);
    for (let c = 0; c < 4; ++c) {
      for (let r = 0; r < 4; ++r) {
        for (let k = 0; k < 4; ++k) out[4 * c + r] += a[4 * k + r] * b[4 * c + k];
      }
    }
    return out;
  }
  function viewMatrix() {
    const ct = Math.cos(camera.turn), st = Math.sin(camera.turn);
    const cp = Math.cos(camera.tilt), sp = Math.sin(camera.tilt);
    const turn = [ct, st, 0, 0, -st, ct, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];
    const tilt = [1, 0, 0, 0, 0, sp, -cp, 0, 0, cp, sp, 0, 0, 0, 0, 1];
    const back = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, camera.x, camera.y, -camera.distance, 1];
    const near = 0.02 * camera.distance, far = camera.distance + 4 * size;
    const f = 1 / Math.tan(0.32), wide = canvas.clientWidth / Math.max(1, canvas.clientHeight);
    const lens = [f / wide, 0, 0, 0, 0, f, 0, 0, 0, 0, (near + far) / (near - far), -1,
                  0, 0, 2 * near * far / (near - far), 0];
    return multiply(lens, multiply(back, multiply(tilt, turn)));
  }

  function drawSurface(view) {
    gl.useProgram(surfaceProgram);
    bind(surfaceProgram, "point", surface.points, 3);
    bind(surfaceProgram, "slope", surface.slopes, 2);
    gl.uniformMatrix4fv(gl.getUniformLocation(surfaceProgram, "view"), false, view);
    gl.uniform1f(gl.getUniformLocation(surfaceProgram, "raise"), raise);
    gl.uniform2f(gl.getUniformLocation(surfaceProgram, "range"), data.low - middleZ, data.high - middleZ);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, surface.faces);
    gl.drawElements(gl.TRIANGLES, surface.count, gl.UNSIGNED_SHORT, 0);
  }
  function drawPath(path, view) {
    gl.useProgram(lineProgram);
    bind(lineProgram, "point", path.points, 3);
    gl.uniformMatrix4fv(gl.getUniformLocation(lineProgram, "view"), false, view);
    gl.uniform1f(gl.getUniformLocation(lineProgram, "raise"), raise);
    gl.uniform3f(gl.getUniformLocation(lineProgram, "color"), ...path.color);
    let first = 0;
    for (const length of path.strips) {
      gl.drawArrays(gl.LINE_STRIP, first, length);
      first += length;
    }
  }

  const paper = (getComputedStyle(holder).backgroundColor.match(/[\d.]+/g) || [])
    .slice(0, 3).map((byte) => Number(byte) / 255);
  let asked = false;
  function draw() {
    asked = false;
    const scale = Math.min(2, window.devicePixelRatio || 1);
    canvas.width = Math.round(canvas.clientWidth * scale);
    canvas.height = Math.round(canvas.clientHeight * scale);
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clearColor(...paper, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    const view = viewMatrix();
    if (showSurface) drawSurface(view);
    for (const path of paths) if (path.shown) drawPath(path, view);
  }
  function ask() {
    if (!asked) requestAnimationFrame(draw);
    asked = true;
  }

  // ---- Hands ----
  const fingers = new Map();
  function spread() {
    const [a, b] = [...fingers.values()];
    return Math.hypot(a.x - b.x, a.y - b.y);
  }
  function zoom(factor) {
    camera.distance = Math.min(6 * size, Math.max(0.03 * size, camera.distance * factor));
    ask();
  }
  function turn(dx, dy) {
    camera.turn += dx;
    camera.tilt = Math.min(Math.PI / 2, Math.max(0.02, camera.tilt + dy));
    ask();
  }
  function shift(dx, dy) {
    camera.x += dx * camera.distance;
    camera.y += dy * camera.distance;
    ask();
  }
  canvas.addEventListener("pointerdown", (e) => {
    canvas.setPointerCapture(e.pointerId);
    fingers.set(e.pointerId, { x: e.clientX, y: e.clientY });
  });
  canvas.addEventListener("pointermove", (e) => {
    const last = fingers.get(e.pointerId);
    if (!last) return;
    const dx = e.clientX - last.x, dy = e.clientY - last.y;
    const before = fingers.size === 2 ? spread() : 0;
    fingers.set(e.pointerId, { x: e.clientX, y: e.clientY });
    if (fingers.size === 2) zoom(before / Math.max(1, spread()));
    else if (e.shiftKey || e.buttons === 2) shift(0.0012 * dx, -0.0012 * dy);
    else turn(0.008 * dx, 0.008 * dy);
  });
  for (const end of ["pointerup", "pointercancel"]) {
    canvas.addEventListener(end, (e) => fingers.delete(e.pointerId));
  }
  canvas.addEventListener("contextmenu", (e) => e.preventDefault());
  canvas.addEventListener("wheel", (e) => {
    e.preventDefault();
    zoom(Math.exp(0.0012 * e.deltaY));
  }, { passive: false });
  function reset() {
    camera = Object.assign({}, start);
    ask();
  }
  const keys = {
    ArrowLeft: () => turn(-0.1, 0), ArrowRight: () => turn(0.1, 0),
    ArrowUp: () => turn(0, 0.08), ArrowDown: () => turn(0, -0.08),
    "+": () => zoom(0.85), "=": () => zoom(0.85), "-": () => zoom(1.18), "0": reset,
    a: () => shift(0.05, 0), d: () => shift(-0.05, 0), w: () => shift(0, -0.05), s: () => shift(0, 0.05),
  };
  canvas.addEventListener("keydown", (e) => {
    if (!keys[e.key] || e.ctrlKey || e.metaKey || e.altKey) return;
    e.preventDefault();
    keys[e.key]();
  });

  // ---- Controls ----
  holder.querySelector("[data-reset]").addEventListener("click", reset);
  holder.querySelector("[data-surface]").addEventListener("change", (e) => {
    showSurface = e.target.checked;
    ask();
  });
  holder.querySelectorAll("[data-path]").forEach((box) => {
    const path = paths[Number(box.dataset.path)];
    path.shown = box.checked;
    box.addEventListener("change", () => {
      path.shown = box.checked;
      ask();
    });
  });
  const slider = holder.querySelector("[data-raise]");
  const told = holder.querySelector("[data-raised]");
  function setRaise() {
    raise = Number(slider.value);
    told.textContent = raise === 1 ? "true height" : "height × " + raise;
    ask();
  }
  slider.addEventListener("input", setRaise);
  setRaise();
  window.addEventListener("resize", ask);
})();
