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

// Places x y z and slopes of every vertex, four and two numbers each, and the triangles' corners.
function decodeSurface(stored, lensSize) {
  const places = new Float32Array(4 * stored.vertices);
  const slopes = stored.facets ? null : new Float32Array(2 * stored.vertices);
  const { columns, rows } = stored;
  for (const channel of stored.channels) {
    if (channel.name === "x") {
      const cell = columns > 1 ? lensSize[0] / (columns - 1) : 0;
      eachNumber(channel, stored.vertices, (i, x) => { places[4 * i] = x + cell * (columns > 1 ? i % columns : 0); });
    } else if (channel.name === "y") {
      const cell = rows > 1 ? lensSize[1] / (rows - 1) : 0;
      eachNumber(channel, stored.vertices, (i, y) => {
        places[4 * i + 1] = y + cell * (rows > 1 ? Math.floor(i / columns) : 0);
      });
    } else if (channel.name === "z") {
      eachNumber(channel, stored.vertices, (i, z) => { places[4 * i + 2] = z; });
    } else {
      const axis = channel.name === "slope_x" ? 0 : 1;
      eachNumber(channel, stored.vertices, (i, slope) => { slopes[2 * i + axis] = slope; });
    }
  }
  const given = stored.corners && bytesOf(document.getElementById(stored.corners).textContent);
  return {
    places, slopes, columns, rows,
    vertices: stored.vertices,
    triangles: stored.triangles,
    zigzag: stored.zigzag,
    corners: given ? new Uint32Array(given.buffer) : null,
  };
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
