// SPDX-License-Identifier: GPL-3.0-or-later
// From what the controls say to what the shaders are told: the lamp and the screen in the lens's
// frame (core/optics/optical_setup.h, light_source.cpp).

const kDegree = Math.PI / 180;

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) =>
  [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const sum = (...terms) => [0, 1, 2].map((k) => terms.reduce((s, [f, v]) => s + f * v[k], 0));
const norm = (a) => Math.hypot(a[0], a[1], a[2]);
const unit = (a) => a.map((x) => x / norm(a));
// About a unit axis, by the right-hand rule.
function rotated(v, axis, angle) {
  const c = Math.cos(angle), s = Math.sin(angle);
  return sum([c, v], [s, cross(axis, v)], [(1 - c) * dot(axis, v), axis]);
}

// Right and up across light of a direction, as seen from where it goes.
function frameAcross(direction) {
  const up = unit(sum([1, [0, 1, 0]], [-direction[1], direction]));
  return { right: cross(up, direction), up };
}

// Cauchy's two terms through the index at 587.56 nm with an Abbe number (core/optics/optical_setup.h).
function indexAt(index, abbe, wavelength) {
  const square = (nm) => 1 / (nm * nm);
  const slope = (index - 1) / abbe / (square(486.13) - square(656.27));
  return index + slope * (square(wavelength) - square(587.56));
}

// A screen as it stands in lens.json, with its axis on the side that light goes to.
function readScreen(screen, middle) {
  const { centre, right, up, size } = screen;
  const away = cross(right, up);
  return { centre, right, up, size,
           away: dot(away, sum([1, centre], [-1, middle])) < 0 ? sum([-1, away]) : away };
}

// The lens as it stands in lens.json: where its middle is, how its light comes, where its screens
// are. map: of a front that is a height map, its samples along x and y; else null.
function readSetup(setup, map) {
  const middle = [setup.lens_size[0] / 2, setup.lens_size[1] / 2, 0];
  const point = setup.source.type === "point" ? setup.source.position : null;
  const light = point ? unit(sum([1, middle], [-1, point])) : setup.source.direction;
  const distance = point ? norm(sum([1, middle], [-1, point])) : Infinity;
  const width = point ? (setup.source.size_mm || 0) / distance : (setup.source.angle_mrad || 0) / 1e3;
  const screen = readScreen(setup.screen, middle);
  return {
    middle, light, distance, width, shape: setup.source.shape || null,
    mirror: setup.mode === "reflect",
    flat: setup.source.emission === "lambertian",
    loses: setup.fresnel === true,
    front: setup.front && setup.front.type === "sphere"
      ? [...setup.front.apex, 1 / setup.front.radius] : [0, 0, 0, 0],
    samples: map ? [map.columns, map.rows, (map.columns - 1) / setup.lens_size[0],
                    (map.rows - 1) / setup.lens_size[1]] : [0, 0, 0, 0],
    index: setup.ior,
    screen, second: setup.second ? readScreen(setup.second, middle) : null,
    screenDistance: norm(sum([1, screen.centre], [-1, middle])),
    lensArea: setup.lens_size[0] * setup.lens_size[1],
    pixels: setup.pixels,
  };
}

// Points of the source with their shares, right and up from its middle in widths, in an order in
// which any few of them are spread over it: Vogel's spiral, or places in the pixels of a shape.
function sourcePoints(optics, wide) {
  if (!wide) return [{ at: [0, 0], share: 1 }];
  const points = optics.shape ? shapePoints(optics.shape) : discPoints();
  const stride = [25, 23, 19, 17, 13, 11, 7, 1].find((k) => points.length % k !== 0 || k === 1);
  return points.map((_, k) => points[(k * stride) % points.length]);
}

const kSourcePoints = 64;

function discPoints() {
  const golden = Math.PI * (3 - Math.sqrt(5));
  return Array.from({ length: kSourcePoints }, (_, i) => {
    const radius = 0.5 * Math.sqrt((i + 0.5) / kSourcePoints);
    return { at: [radius * Math.cos(i * golden), radius * Math.sin(i * golden)], share: 1 };
  });
}

function shapePoints(shape) {
  const rows = shape.length, columns = shape[0].length, points = [];
  const lit = shape.flat().filter((weight) => weight > 0).length;
  const parts = Math.max(1, Math.floor(Math.sqrt(kSourcePoints / lit)));
  shape.forEach((row, r) => row.forEach((weight, c) => {
    for (let k = 0; weight > 0 && k < parts * parts; ++k) {
      const x = c + (k % parts + 0.5) / parts, y = r + (Math.floor(k / parts) + 0.5) / parts;
      points.push({ at: [(x - columns / 2) / columns, (rows / 2 - y) / columns], share: weight });
    }
  }));
  return points;
}

// The screen that the settings ask for, before it is tilted. Between two its size, place and turn
// change evenly from the first to the second.
function screenAt(optics, settings) {
  const { middle, screen, second } = optics;
  if (!second) {
    const far = settings.screenDistance / optics.screenDistance;
    return { ...screen, centre: sum([1, middle], [far, sum([1, screen.centre], [-1, middle])]) };
  }
  const share = settings.between;
  const mix = (name) => sum([1 - share, screen[name]], [share, second[name]]);
  const right = unit(mix("right")), across = mix("up");
  return { centre: mix("centre"), right, up: unit(sum([1, across], [-dot(across, right), right])),
           away: unit(mix("away")),
           size: [0, 1].map((k) => (1 - share) * screen.size[k] + share * second.size[k]) };
}

// The lamp and the screen for one point of the source.
function placedOptics(optics, settings, at) {
  const frame = frameAcross(optics.light);
  const place = [Math.tan(settings.lampRight * kDegree) + settings.lampSize / 1e3 * at[0],
                 Math.tan(settings.lampUp * kDegree) + settings.lampSize / 1e3 * at[1]];
  // The lens turns in the light: in its own frame lamp and screen turn the other way.
  const turned = (v) => rotated(rotated(v, [0, 1, 0], -settings.turn * kDegree), [1, 0, 0],
                                -settings.tip * kDegree);
  const standing = (v) => sum([1, optics.middle], [1, turned(v)]);
  const from = sum([-1, optics.light], [place[0], frame.right], [place[1], frame.up]);
  const parallel = settings.lampDistance === Infinity;
  const lamp = parallel ? turned(unit(sum([-1, from])))
                        : standing(sum([settings.lampDistance, from]));
  const way = parallel ? lamp : sum([1, optics.middle], [-1, lamp]);
  const screen = screenAt(optics, settings);
  const tilt = (v) => rotated(rotated(v, screen.right, settings.tiltRight * kDegree), screen.up,
                              settings.tiltUp * kDegree);
  const bent = optics.front[3] !== 0 || optics.samples[0] > 0;
  return {
    mirror: optics.mirror, eta: indexAt(settings.index, settings.abbe, settings.wavelength),
    lamp: [...lamp, parallel ? 0 : 1], front: optics.front,
    samples_: optics.samples,
    // A parallel beam through a flat front has one slope; others come to 1e-6 of a millimetre.
    steps: optics.mirror ? 0 : parallel && !bent ? 1 : 16,
    source: [...unit(way), optics.flat && !parallel ? 1 : 0],
    scale: parallel ? 1 : dot(way, way) * norm(way) / way[2],
    loses: optics.loses, varies: !parallel || bent,
    straight: parallel && !bent && !optics.mirror && !optics.loses && lamp[2] === 1,
    centre: standing(sum([1, screen.centre], [-1, optics.middle])),
    right: turned(tilt(screen.right)), up: turned(tilt(screen.up)), away: turned(tilt(screen.away)),
  };
}
