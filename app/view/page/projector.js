// SPDX-License-Identifier: GPL-3.0-or-later
// Draws the light of a surface on the screen: pass after pass, each in the light of one point of the
// source, added up in floating point.

// What the browser must be able to do; null, or what it lacks.
function missingFeature(gl) {
  if (!gl) return "This browser has no WebGL 2";
  if (!gl.getExtension("EXT_color_buffer_float")) return "This browser cannot draw into floating-point textures";
  if (typeof DecompressionStream === "undefined") return "This browser cannot unpack the lens's surface";
  return null;
}

const kPrograms = {
  nodes: [kFullScreen, kNodes],
  landing: [kFullScreen, kLanding],
  triangle: [kFullScreen, kTriangle],
  drawing: [kDraw, kAdd],
  averaging: [kFullScreen, kPixels],
  showing: [kFullScreen, kShow],
};

class Projector {
  // pixels: of the picture, columns and rows. front: coefficients of a front that is a height map, or
  // null.
  constructor(canvas, gl, pixels, front) {
    this.canvas = canvas;
    this.gl = gl;
    this.programs = new Map();
    this.pixels = pixels;
    // Without float blending half floats add the light, with 11 bits.
    this.exact = gl.getExtension("EXT_float_blend") !== null;
    gl.bindVertexArray(gl.createVertexArray());
    // The picture is drawn in parts no larger than the largest point.
    this.largest = Math.max(64, gl.getParameter(gl.ALIASED_POINT_SIZE_RANGE)[1]);
    this.sums = this.target(this.exact ? gl.R32F : gl.R16F, pixels[0], pixels[1]);
    this.mean = this.target(gl.RGBA32F, pixels[0], pixels[1]);
    this.still = null;
    this.passes = 0;
    this.heights = this.heightMap(front);
  }

  heightMap(front) {
    const gl = this.gl, width = front ? front.columns + 4 : 1, height = front ? front.rows + 4 : 1;
    const values = new Float32Array(width * height);
    if (front) eachNumber(front.values, values.length, (i, value) => { values[i] = value; });
    const made = this.texture(gl.R32F, width, height);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, width, height, gl.RED, gl.FLOAT, values);
    return made;
  }

  // A program, built when it is first used, so that the first picture need not wait for the others.
  program(name) {
    if (!this.programs.has(name)) this.programs.set(name, this.built(...kPrograms[name]));
    return this.programs.get(name);
  }
  built(vertex, fragment) {
    const gl = this.gl, made = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
      gl.attachShader(made, shader);
    }
    gl.linkProgram(made);
    if (!gl.getProgramParameter(made, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(made));
    const places = new Map();
    const place = (name) => {
      if (!places.has(name)) places.set(name, gl.getUniformLocation(made, name));
      return places.get(name);
    };
    return { made, place };
  }

  texture(format, width, height) {
    const gl = this.gl, made = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, made);
    gl.texStorage2D(gl.TEXTURE_2D, 1, format, width, height);
    for (const name of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) {
      gl.texParameteri(gl.TEXTURE_2D, name, gl.NEAREST);
    }
    return { made, width, height };
  }
  target(format, width, height) {
    const gl = this.gl, texture = this.texture(format, width, height);
    texture.frame = gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, texture.frame);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, texture.made, 0);
    return texture;
  }
  // A list of numbers, `width` to an entry, as a texture of rows.
  list(values, width, [format, layout, type]) {
    const gl = this.gl, rows = Math.max(1, Math.ceil(values.length / width / kSide));
    const made = this.texture(format, kSide, rows);
    const whole = new values.constructor(rows * kSide * width);
    whole.set(values);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, kSide, rows, layout, type, whole);
    return made;
  }
  emptyList(format, count) {
    return this.target(format, kSide, Math.max(1, Math.ceil(count / kSide)));
  }

  free(lists) {
    for (const old of Object.values(lists)) {
      this.gl.deleteTexture(old.made);
      if (old.frame) this.gl.deleteFramebuffer(old.frame);
    }
  }

  setSurface(surface) {
    const gl = this.gl;
    this.free(this.lists || {});
    this.surface = surface;
    this.landings = surface.facets ? 3 * surface.triangles : surface.vertices;
    const [places, slopes] = surface.spline ? this.nodesOf(surface) : [
      this.list(surface.places, 4, [gl.RGBA32F, gl.RGBA, gl.FLOAT]),
      this.list(surface.slopes || new Float32Array(2), 2, [gl.RG32F, gl.RG, gl.FLOAT])];
    this.lists = {
      places, slopes,
      corners: this.list(surface.corners || new Uint32Array(1), 1,
                         [gl.R32UI, gl.RED_INTEGER, gl.UNSIGNED_INT]),
      landings: this.emptyList(gl.RGBA32F, this.landings),
      fluxes: this.emptyList(gl.RG32F, surface.triangles),
    };
  }

  // Places and slopes of a spline's nodes.
  nodesOf(surface) {
    const gl = this.gl, { spline, columns, rows, vertices } = surface;
    const list = (values, width, format) => this.list(values, width, format);
    const numbers = (values) => list(values, 1, [gl.R32F, gl.RED, gl.FLOAT]);
    const table = (cells) => list(basisTable(cells, spline.samples), 4, [gl.RGBA32F, gl.RGBA, gl.FLOAT]);
    const none = new Float32Array(1);
    const given = { net_x: numbers(spline.bent ? spline.x : none), net_y: numbers(spline.bent ? spline.y : none),
                    net_z: numbers(spline.z), along: table(spline.columns - 3), across: table(spline.rows - 3) };
    const places = this.emptyList(gl.RGBA32F, vertices), slopes = this.emptyList(gl.RG32F, vertices);
    gl.bindFramebuffer(gl.FRAMEBUFFER, places.frame);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT1, gl.TEXTURE_2D, slopes.made, 0);
    gl.drawBuffers([gl.COLOR_ATTACHMENT0, gl.COLOR_ATTACHMENT1]);
    this.use("nodes", { net: [spline.columns, spline.rows], grid: [columns, rows], samples: spline.samples,
                           count: vertices, cell: spline.cell, level: spline.level, bent: spline.bent }, given);
    this.fill(places);
    gl.bindFramebuffer(gl.FRAMEBUFFER, places.frame);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT1, gl.TEXTURE_2D, null, 0);
    gl.drawBuffers([gl.COLOR_ATTACHMENT0]);
    this.free(given);
    return [places, slopes];
  }

  // Puts a program to work: its uniforms, and the textures that it reads by name.
  use(name, numbers, textures) {
    const gl = this.gl, program = this.program(name);
    gl.useProgram(program.made);
    Object.entries(textures).forEach(([sampler, texture], unit) => {
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(gl.TEXTURE_2D, texture.made);
      gl.uniform1i(program.place(sampler), unit);
    });
    for (const [uniform, value] of Object.entries(numbers)) {
      const place = program.place(uniform);
      if (!place) continue;
      if (Number.isInteger(value) && kWhole.has(uniform)) gl.uniform1i(place, value);
      else if (typeof value === "boolean") gl.uniform1i(place, value ? 1 : 0);
      else if (typeof value === "number") gl.uniform1f(place, value);
      else if (kWhole.has(uniform)) gl[`uniform${value.length}i`](place, ...value);
      else gl[`uniform${value.length}f`](place, ...value);
    }
  }
  fill(target, rows) {
    const gl = this.gl;
    gl.bindFramebuffer(gl.FRAMEBUFFER, target ? target.frame : null);
    const width = target ? target.width : this.canvas.width;
    gl.viewport(0, 0, width, rows || (target ? target.height : this.canvas.height));
    gl.disable(gl.BLEND);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }

  // Begins a picture. halves: of the screen that is shown, mm.
  begin(halves) {
    const gl = this.gl;
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.sums.frame);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT);
    Object.assign(this, { halves, passes: 0, whole: 0, share: 0 });
  }

  surfaceNumbers() {
    const { columns, rows, zigzag, corners, facets } = this.surface;
    return { grid: [columns, rows], layout_: corners ? 0 : zigzag ? 2 : 1, facets };
  }

  // Where the light of every vertex lands, and how much every triangle has.
  trace(optics) {
    const { places, slopes, corners, landings, fluxes } = this.lists;
    const numbers = { ...this.surfaceNumbers(), ...optics };
    const rows = (count) => Math.ceil(count / kSide);
    this.use("landing", { ...numbers, count: this.landings },
             { places, slopes, corners, heights: this.heights });
    this.fill(landings, rows(this.landings));
    this.use("triangle", { ...numbers, count: this.surface.triangles },
             { places, slopes, corners, landings, heights: this.heights });
    this.fill(fluxes, rows(this.surface.triangles));
  }

  read(target, width, height) {
    const gl = this.gl, values = new Float32Array(4 * width * height);
    gl.bindFramebuffer(gl.FRAMEBUFFER, target.frame);
    gl.readPixels(0, 0, width, height, gl.RGBA, gl.FLOAT, values);
    return values;
  }
  // Light that the whole surface takes, mm2.
  takenLight() {
    const count = this.surface.triangles;
    const values = this.read(this.lists.fluxes, kSide, Math.ceil(count / kSide));
    let sum = 0;
    for (let t = 0; t < count; ++t) sum += values[4 * t + 1];
    return sum;
  }

  // Adds the light of one point of the source. whole: light that the surface takes, mm2, where that
  // is known.
  pass(optics, share, whole) {
    const gl = this.gl, { corners, landings, fluxes } = this.lists;
    this.trace(optics);
    this.whole = this.whole || whole || this.takenLight();
    const [columns, rows] = this.pixels, { surface } = this;
    const pairs = !surface.corners && !surface.facets;
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.sums.frame);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE);
    const numbers = { ...this.surfaceNumbers(), halves: this.halves, pixels: this.pixels, pairs,
                      weight: share * columns * rows / this.whole };
    for (let row = 0; row < rows; row += this.largest) {
      for (let column = 0; column < columns; column += this.largest) {
        const part = [column, row, Math.min(this.largest, columns - column), Math.min(this.largest, rows - row)];
        gl.viewport(...part);
        this.use("drawing", { ...numbers, part }, { corners, landings, fluxes });
        gl.drawArrays(gl.POINTS, 0, pairs ? surface.triangles / 2 : surface.triangles);
      }
    }
    this.share += share;
    ++this.passes;
  }

  average() {
    this.use("averaging", { gain: 1 / this.share }, { sums: this.sums });
    this.fill(this.mean);
  }
  // Shows a given picture, linear light with row 0 on top, instead of the one that is drawn; null
  // ends that.
  keep(picture) {
    const gl = this.gl, [columns, rows] = this.pixels;
    if (this.still) gl.deleteTexture(this.still.made);
    this.still = null;
    if (!picture) return;
    const flipped = new Float32Array(columns * rows);
    for (let r = 0; r < rows; ++r) flipped.set(picture.subarray(r * columns, (r + 1) * columns), (rows - 1 - r) * columns);
    this.still = this.texture(gl.R32F, columns, rows);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, columns, rows, gl.RED, gl.FLOAT, flipped);
  }
  // exposure: of the picture kept; gain: light of an even picture.
  show(exposure, gain) {
    const { canvas, still } = this;
    if (!still) this.average();
    this.use("showing", { exposure: still ? exposure : exposure * gain, size: [canvas.width, canvas.height] },
             { picture: still || this.mean });
    this.fill(null);
  }
  // Linear light, 1 for an evenly lit picture; row 0 on top.
  picture() {
    const [columns, rows] = this.pixels;
    this.average();
    const values = this.read(this.mean, columns, rows), picture = new Float32Array(columns * rows);
    for (let r = 0; r < rows; ++r) {
      for (let c = 0; c < columns; ++c) {
        picture[r * columns + c] = values[4 * ((rows - 1 - r) * columns + c)];
      }
    }
    return picture;
  }

  // Places on the lens from which light comes to a square on the screen, with what they send: the
  // triangles whose light covers it. at: mm from the screen's centre.
  sourcesOf(at, half) {
    const lands = this.read(this.lists.landings, kSide, Math.ceil(this.landings / kSide));
    const flux = this.read(this.lists.fluxes, kSide, Math.ceil(this.surface.triangles / kSide));
    const { facets, triangles, vertices } = this.surface, found = [];
    const places = this.surface.places || this.read(this.lists.places, kSide, Math.ceil(vertices / kSide));
    for (let t = 0; t < triangles; ++t) {
      if (!(flux[4 * t] > 0)) continue;
      const v = cornersOf(this.surface, t), l = facets ? [3 * t, 3 * t + 1, 3 * t + 2] : v;
      const p = [0, 1, 2].map((k) => [lands[4 * l[k]] - at[0], lands[4 * l[k] + 1] - at[1]]);
      const covered = coveredArea(p, half), area = coveredArea(p, Infinity);
      if (!(covered > 0)) continue;
      const middle = (k) => (places[4 * v[0] + k] + places[4 * v[1] + k] + places[4 * v[2] + k]) / 3;
      found.push({ x: middle(0), y: middle(1), light: covered / area * flux[4 * t] });
    }
    return found;
  }
}

// Uniforms that are whole numbers.
const kWhole = new Set(["layout_", "steps", "count", "samples", "grid", "net", "part"]);

// Area of a triangle inside the square of half-side `half` about the origin (Sutherland and Hodgman).
function coveredArea(triangle, half) {
  for (let k = 0; k < 2; ++k) {
    if (triangle.every((p) => p[k] > half) || triangle.every((p) => p[k] < -half)) return 0;
  }
  let polygon = triangle;
  for (const [k, sign] of [[0, 1], [0, -1], [1, 1], [1, -1]]) {
    const outside = (p) => sign * p[k] - half;
    const kept = [];
    polygon.forEach((p, i) => {
      const q = polygon[(i + 1) % polygon.length], a = outside(p), b = outside(q);
      if (a <= 0) kept.push(p);
      if ((a < 0 && b > 0) || (a > 0 && b < 0)) {
        const s = a / (a - b);
        kept.push([p[0] + s * (q[0] - p[0]), p[1] + s * (q[1] - p[1])]);
      }
    });
    polygon = kept;
  }
  let twice = 0;
  polygon.forEach((p, i) => {
    const q = polygon[(i + 1) % polygon.length];
    twice += p[0] * q[1] - p[1] * q[0];
  });
  return Math.abs(twice) / 2;
}
