// SPDX-License-Identifier: GPL-3.0-or-later
// Surfaces as the page holds them (app/view/lens_view.h), decoded.

function bytesOf(base64) {
  const text = atob(base64);
  const bytes = new Uint8Array(text.length);
  for (let i = 0; i < bytes.length; ++i) bytes[i] = text.charCodeAt(i);
  return bytes;
}

// Calls take(i, value) for every one of `count` numbers of a channel.
function eachNumber(channel, count, take) {
  if (channel.bytes === 0) {
    for (let i = 0; i < count; ++i) take(i, channel.low);
    return;
  }
  const bytes = bytesOf(document.getElementById(channel.element).textContent);
  const scale = (channel.high - channel.low) / (2 ** (8 * channel.bytes) - 1);
  for (let i = 0, k = 0; i < count; ++i, k += channel.bytes) {
    let number = bytes[k];
    for (let b = 1; b < channel.bytes; ++b) number += bytes[k + b] * 2 ** (8 * b);
    take(i, channel.low + scale * number);
  }
}

// A picture's linear light, 1 is white, from its display-encoded values.
function pictureOf(stored) {
  const picture = new Float32Array(stored.columns * stored.rows);
  eachNumber(stored.values, picture.length, (i, value) => {
    picture[i] = value <= 0.04045 ? value / 12.92 : ((value + 0.055) / 1.055) ** 2.4;
  });
  return picture;
}

async function inflated(bytes) {
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

// Undoes differences of second order along a line of `count` numbers, `stride` apart.
function addUp(numbers, first, count, stride) {
  for (let i = 1, at = first + stride; i < count; ++i, at += stride) {
    numbers[at] += 2 * numbers[at - stride] - (i > 1 ? numbers[at - 2 * stride] : 0);
  }
}

// The whole numbers of a channel: steps above its lowest value.
async function stepsOf(channel) {
  const { columns, rows } = channel, count = columns * rows;
  const numbers = new Int32Array(count);
  if (channel.step === 0) return numbers;
  const bytes = await inflated(bytesOf(document.getElementById(channel.element).textContent));
  for (let i = 0; i < count; ++i) {
    const folded = bytes[i] | bytes[i + count] << 8 | bytes[i + 2 * count] << 16 | bytes[i + 3 * count] << 24;
    numbers[i] = folded >>> 1 ^ -(folded & 1);
  }
  for (let column = 0; column < columns; ++column) addUp(numbers, column, rows, columns);
  for (let row = 0; row < rows; ++row) addUp(numbers, row * columns, columns, 1);
  return numbers;
}

// The numbers of a channel, relative to `level`.
async function channelOf(stored, name, level = 0) {
  const channel = stored.channels.find((one) => one.name === name);
  const low = channel.low - level, step = channel.step;
  return Float32Array.from(await stepsOf(channel), (number) => low + step * number);
}

// Control points as offsets from an even grid; heights above their lowest, since floats near 0 are
// finer.
async function decodedSpline(stored, lensSize) {
  const { columns, rows, low } = stored.channels.find((one) => one.name === "z");
  const [x, y, z] = await Promise.all([channelOf(stored, "x"), channelOf(stored, "y"), channelOf(stored, "z", low)]);
  const bent = stored.channels.some((one) => one.name !== "z" && one.step !== 0);
  return { x, y, z, bent, columns, rows, level: low, samples: stored.samples,
           cell: [lensSize[0] / (columns - 3), lensSize[1] / (rows - 3)] };
}

// Places x y z and slopes of every vertex, four and two numbers each.
async function decodedMesh(stored, lensSize) {
  const { columns, rows, vertices } = stored;
  const [x, y, z] = await Promise.all(["x", "y", "z"].map((name) => channelOf(stored, name)));
  const places = new Float32Array(4 * vertices);
  const across = columns > 1 ? lensSize[0] / (columns - 1) : 0, up = rows > 1 ? lensSize[1] / (rows - 1) : 0;
  for (let i = 0; i < vertices; ++i) {
    places[4 * i] = x[i] + (columns > 1 ? across * (i % columns) : 0);
    places[4 * i + 1] = y[i] + (columns > 1 ? up * Math.floor(i / columns) : 0);
    places[4 * i + 2] = z[i];
  }
  if (stored.facets) return { places, slopes: null };
  const slopes = new Float32Array(2 * vertices);
  const [right, rising] = await Promise.all(["slope_x", "slope_y"].map((name) => channelOf(stored, name)));
  for (let i = 0; i < vertices; ++i) {
    slopes[2 * i] = right[i];
    slopes[2 * i + 1] = rising[i];
  }
  return { places, slopes };
}

async function decodeSurface(stored, lensSize) {
  const { columns, rows, vertices, triangles, zigzag, facets } = stored;
  const corners = stored.channels.find((one) => one.name === "corners");
  return {
    id: stored.id, columns, rows, vertices, triangles, zigzag, facets,
    corners: corners ? new Uint32Array(await stepsOf(corners)).map((v) => v + corners.low) : null,
    spline: stored.spline ? await decodedSpline(stored, lensSize) : null,
    ...(stored.spline ? {} : await decodedMesh(stored, lensSize)),
  };
}

// Values and slopes of the four cubic B-splines over [0, cells] that are not 0 at each of the nodes,
// `samples` to a knot cell; the knots at the ends are fourfold (core/spline/control_net.h).
function basisTable(cells, samples) {
  const table = new Float32Array(8 * (cells * samples + 1));
  for (let i = 0; i <= cells * samples; ++i) {
    const cell = Math.min(Math.floor(i / samples), cells - 1), t = i / samples;
    const knot = (k) => Math.min(Math.max(cell + k, 0), cells);
    let n = [1], lower = n;
    for (let p = 1; p <= 3; ++p) {
      lower = n;
      n = new Array(p + 1).fill(0);
      lower.forEach((value, r) => {
        const left = knot(r + 1 - p), right = knot(r + 1), share = value / (right - left);
        n[r] += (right - t) * share;
        n[r + 1] += (t - left) * share;
      });
    }
    const slope = [0, 0, 0, 0];
    lower.forEach((value, r) => {
      const share = 3 * value / (knot(r + 1) - knot(r - 2));
      slope[r] -= share;
      slope[r + 1] += share;
    });
    table.set(n, 8 * i);
    table.set(slope, 8 * i + 4);
  }
  return table;
}

// The vertices of a triangle; as corners_of() in the shaders.
function cornersOf(surface, triangle) {
  if (surface.corners) return surface.corners.subarray(3 * triangle, 3 * triangle + 3);
  const cell = Math.floor(triangle / 2), row = Math.floor(cell / (surface.columns - 1));
  const a = row * surface.columns + cell % (surface.columns - 1), d = a + surface.columns;
  if (surface.zigzag && row % 2 === 0) {
    return triangle % 2 === 0 ? [a, a + 1, d] : [a + 1, d + 1, d];
  }
  return triangle % 2 === 0 ? [a, a + 1, d + 1] : [a, d + 1, d];
}
