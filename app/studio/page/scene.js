// SPDX-License-Identifier: GPL-3.0-or-later
// Lamp, lens and wall in space, in an own perspective, as SVG.
//
// The frame is the lens's: z along the light, y up. A viewer in front of the wall has −x on the right.

const kFirstView = { yaw: 0.62, pitch: 0.26 };
const kTurnOfKey = 0.12;    // rad
const kTurnOfPixel = 0.008; // rad
// Distances beyond so many times the largest thing are drawn shorter, and say so.
const kFarthest = 4.5;

const scene = { ...kFirstView, light: null, picture: null, width: 0 };

// ---- Projection ----
function camera(yaw, pitch) {
  const sa = Math.sin(yaw), ca = Math.cos(yaw), se = Math.sin(pitch), ce = Math.cos(pitch);
  return { right: [-ca, 0, sa], up: [sa * se, ce, ca * se], forward: [ce * sa, -se, ce * ca] };
}
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

function project(point, view, middle, distance) {
  const from = [point[0], point[1], point[2] - middle];
  const scale = distance / (distance + dot(from, view.forward));
  return [scale * dot(from, view.right), -scale * dot(from, view.up)];
}

const times = (v, factor) => v.map((value) => factor * value);
const plus = (...vectors) => [0, 1, 2].map((i) => vectors.reduce((sum, v) => sum + v[i], 0));
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const norm = (v) => Math.hypot(...v);
const unit = (v) => times(v, 1 / norm(v));

// The corners of a rectangle, from the top left of one who sees `right` on the right.
function rectangle(size, centre, right = [-1, 0, 0], up = [0, 1, 0]) {
  const x = times(right, size[0] / 2), y = times(up, size[1] / 2);
  return [plus(centre, times(x, -1), y), plus(centre, x, y), plus(centre, x, times(y, -1)), plus(centre, times(x, -1), times(y, -1))];
}

// ---- What there is, in millimetres from the middle of the part ----
const extent = (points, axis) => [Math.min(...points.map((p) => p[axis])), Math.max(...points.map((p) => p[axis]))];

// The lamp: its place, which parallel light does not have, its size there and how far it is.
function layoutOfLamp(setup, middle, wall, drawn) {
  const source = setup.source, size = source.size_mm || 0;
  if (!source.position) {
    const words = source.angle_mrad ? `parallel light, ${number(source.angle_mrad, 3)} mrad` : "parallel light";
    return { at: times(source.direction, -0.75 * norm(wall)), size: setup.lens_size, parallel: true, words };
  }
  const offset = plus(source.position, middle);
  return { at: drawn(offset), size: [size, size], mm: norm(offset), parallel: false };
}

// The second picture: how far it is, and where it is drawn, shortened as the first one is, and at most twice as far.
function secondWall(second, middle, first, wall) {
  const offset = plus(second.centre, middle), at = times(offset, norm(wall) * Math.min(1 / norm(first), 2 / norm(offset)));
  return { shape: rectangle(second.size, at, second.right, second.up), at, mm: norm(offset), size: second.size };
}

// `light` has the optical setup as lens.json has it. Light goes along rectangles: from the lamp to the face where it
// enters, from the face where it leaves to the picture.
function layout(light) {
  const { lens_size: size, screen, mode } = light.setup, middle = [-size[0] / 2, -size[1] / 2, 0];
  const largest = Math.max(...size, ...screen.size), mirror = mode === "reflect";
  const drawn = (offset) => times(offset, Math.min(1, kFarthest * largest / norm(offset)));
  const offset = plus(screen.centre, middle), wall = drawn(offset), lamp = layoutOfLamp(light.setup, middle, wall, drawn);
  const thick = mirror ? -0.05 * Math.max(...size) : Math.min(light.thickness_mm, 0.4 * norm(wall));
  // A lamp at a place faces the part, parallel light is as wide as the part.
  const axis = lamp.parallel ? [0, 0, 1] : times(lamp.at, Math.sign(lamp.at[2])), across = unit(cross(axis, [0, 1, 0]));
  const shapes = { lamp: rectangle(lamp.size, lamp.at, across, unit(cross(across, axis))), enter: rectangle(size, [0, 0, 0]), leave: rectangle(size, [0, 0, Math.max(thick, 0)]),
    other: rectangle(size, [0, 0, thick]), picture: rectangle(screen.size, wall, screen.right, screen.up) };
  // Light does not change sides on its way to a picture that is seen from behind.
  shapes.landing = screen.right[0] < 0 ? shapes.picture : [1, 0, 3, 2].map((i) => shapes.picture[i]);
  const far = light.setup.second && secondWall(light.setup.second, middle, offset, wall);
  if (far) shapes.second = far.shape;
  const ends = [...shapes.enter, ...shapes.picture, ...shapes.lamp, ...(far ? far.shape : [])], border = 0.12 * Math.max(screen.size[0], size[0]);
  const sides = extent(ends, 0), along = extent(ends, 2), floor = extent(ends, 1)[0] - 0.12 * Math.max(screen.size[1], size[1]);
  shapes.wall = rectangle([0, 1].map((i) => 1.24 * Math.max(size[i], screen.size[i])), wall, screen.right, screen.up);
  return { shapes, lamp, wall, wallMm: norm(offset), far, mirror, floor, along, sides: [sides[0] - border, sides[1] + border],
    normal: cross(screen.right, screen.up) };
}

const lineWords = (distance, drawn) => millimetres(distance) + (drawn < 0.999 * distance ? ", drawn shorter" : "");

// ---- Shapes: text of SVG. `at` projects a point to "x,y". ----
const face = (points, at, kind) => `<polygon class="${kind}" points="${points.map(at).join(" ")}"/>`;
const line = (a, b, at, kind) => `<path class="${kind}" d="M${at(a)}L${at(b)}"/>`;

// Words about a place, kept inside of the frame; a letter is about 7 pixels wide.
function textAt(x, y, words, kind) {
  const half = 3.6 * words.length + 6, inside = Math.max(half, Math.min(scene.width - half, x));
  return `<text class="${kind}" x="${inside.toFixed(1)}" y="${y.toFixed(1)}">${words}</text>`;
}
function label(point, at, words, kind = "", dy = 0) {
  const [x, y] = at(point).split(",").map(Number);
  return textAt(x, y + dy, words, kind);
}

// The sides of the light between two rectangles.
function beam(from, to, at, kind) {
  return from.map((corner, i) => face([corner, from[(i + 1) % 4], to[(i + 1) % 4], to[i]], at, kind)).join("");
}

function floorLines(room, at) {
  const [left, right] = room.sides, [from, to] = room.along, step = (to - from) / 8;
  let lines = "";
  for (let i = 0; i <= 8; ++i) lines += line([left, room.floor, from + i * step], [right, room.floor, from + i * step], at, "floor");
  for (let i = 0; i <= 4; ++i) lines += line([left + i * (right - left) / 4, room.floor, from], [left + i * (right - left) / 4, room.floor, to], at, "floor");
  return lines;
}

// A plate with its back, its edges and, towards the eye, its front.
function partShape({ shapes, mirror }, at, view) {
  const kind = mirror ? "mirror" : "glass", lit = mirror ? "mirror silver" : "glass lit";
  const sides = beam(shapes.enter, shapes.other, at, kind);
  if (!mirror) return face(shapes.enter, at, kind) + sides + face(shapes.other, at, lit);
  return view.forward[2] > 0 ? face(shapes.enter, at, lit) + sides + face(shapes.other, at, kind)
    : face(shapes.other, at, kind) + sides + face(shapes.enter, at, lit);
}

function lampShape({ lamp, shapes }, at) {
  if (lamp.parallel) return shapes.lamp.map((corner, i) => line(corner, shapes.enter[i], at, "ray")).join("");
  const [x, y] = at(lamp.at).split(","), corners = shapes.lamp.map((corner) => at(corner).split(","));
  const radius = Math.max(3, ...corners.map((corner) => Math.SQRT1_2 * Math.hypot(corner[0] - x, corner[1] - y)));
  return `<circle class="glow" cx="${x}" cy="${y}" r="${3.2 * radius}"/><circle class="bulb" cx="${x}" cy="${y}" r="${radius}"/>`;
}

function lightShapes({ shapes }, at) {
  const rays = shapes.leave.map((corner, i) => line(corner, shapes.landing[i], at, "ray")).join("");
  return { before: beam(shapes.lamp, shapes.enter, at, "beam"), behind: beam(shapes.leave, shapes.landing, at, "beam") + rays };
}

// Distances are measured on the floor: for a lens on the side that is nearer to the eye, for a mirror below the light.
function measures(room, at, view) {
  const x = room.mirror ? 0 : room.sides[view.forward[0] > 0 ? 0 : 1], mark = 0.02 * (room.sides[1] - room.sides[0]);
  const foot = (point) => [point[0] + x, room.floor, point[2]], start = foot([0, 0, 0]);
  const tick = (p) => line([p[0] - mark, p[1], p[2]], [p[0] + mark, p[1], p[2]], at, "measure");
  const bar = (end) => tick(start) + tick(end) + line(start, end, at, "measure");
  const words = (end, text) => label(plus(times(plus(start, end), 0.5), [room.mirror ? 0 : Math.sign(x) * mark, 0, 0]), at, text, "", 18);
  const lampWords = room.lamp.parallel ? room.lamp.words : lineWords(room.lamp.mm, norm(room.lamp.at));
  const far = room.far ? bar(foot(room.far.at)) + words(foot(room.far.at), lineWords(room.far.mm, norm(room.far.at))) : "";
  return far + (room.lamp.parallel ? "" : bar(foot(room.lamp.at))) + bar(foot(room.wall)) + words(foot(room.lamp.at), lampWords) +
    words(foot(room.wall), lineWords(room.wallMm, norm(room.wall)));
}

// Names stand above the highest corner of their thing.
function nameAbove(corners, at, words) {
  const places = corners.map((p) => at(p).split(",").map(Number));
  const x = places.reduce((sum, p) => sum + p[0] / 4, 0), y = Math.min(...places.map((p) => p[1])) - 10;
  return textAt(x, y, words, "named");
}

function names(light, room, at) {
  const { lamp, shapes } = room, { lens_size: size, screen } = light.setup;
  const lampName = lamp.parallel ? "" : label(plus(lamp.at, [0, lamp.size[1] / 2, 0]), at, lamp.size[0] ? `lamp ${millimetres(lamp.size[0])}` : "lamp", "named", -16);
  return lampName + nameAbove(shapes.enter, at, `${room.mirror ? "mirror" : "lens"} ${sizeText(size)}`) +
    nameAbove(shapes.picture, at, `picture ${sizeText(screen.size)}`) +
    (room.far ? nameAbove(shapes.second, at, `second picture ${sizeText(room.far.size)}`) : "");
}

// ---- Drawing ----
// The picture stays in the document; all else is drawn anew, below and above it.
const kSceneParts = `<defs><radialGradient id="glow"><stop offset="0" stop-color="#ffe2a8"/>
  <stop offset=".3" stop-color="#f2b35e" stop-opacity=".5"/><stop offset="1" stop-color="#f2b35e" stop-opacity="0"/></radialGradient></defs>
  <g></g><image width="1" height="1" preserveAspectRatio="none"/><g></g>`.replace(/>\s+</g, "><");

// Fits everything that is measured into the frame, whatever the angle.
function fitted(room, view, width, height) {
  const { shapes, along, sides, floor } = room, middle = (along[0] + along[1]) / 2;
  const points = [...shapes.wall, ...shapes.enter, ...(shapes.second || []), ...(room.lamp.parallel ? [] : shapes.lamp), ...along.flatMap((z) => sides.map((x) => [x, floor, z]))];
  const distance = 4 * Math.max(along[1] - along[0], sides[1] - sides[0]);
  const flat = points.map((p) => project(p, view, middle, distance));
  const bounds = [0, 1].map((axis) => extent(flat, axis));
  const scale = Math.min((width - 70) / (bounds[0][1] - bounds[0][0]), (height - 76) / (bounds[1][1] - bounds[1][0]));
  const offset = [width / 2 - scale * (bounds[0][0] + bounds[0][1]) / 2, height / 2 - scale * (bounds[1][0] + bounds[1][1]) / 2];
  return (point) => {
    const p = project(point, view, middle, distance);
    return `${(offset[0] + scale * p[0]).toFixed(2)},${(offset[1] + scale * p[1]).toFixed(2)}`;
  };
}

// The affine map that is nearest to the perspective of the picture's corners.
function picturePlace(corners, at) {
  const [a, b, c, d] = corners.map((p) => at(p).split(",").map(Number));
  const across = [0, 1].map((i) => (b[i] - a[i] + c[i] - d[i]) / 2), down = [0, 1].map((i) => (d[i] - a[i] + c[i] - b[i]) / 2);
  const corner = [0, 1].map((i) => (a[i] + b[i] + c[i] + d[i]) / 4 - across[i] / 2 - down[i] / 2);
  return `matrix(${[...across, ...down, ...corner].map((v) => v.toFixed(3)).join(" ")})`;
}

function drawScene() {
  const svg = find("scene").querySelector("svg"), light = scene.light, width = svg.clientWidth, height = svg.clientHeight;
  if (!light || light.error || !width) return;
  scene.width = width;
  if (!svg.firstChild) svg.innerHTML = kSceneParts;
  const [, below, image, above] = svg.children, room = layout(light), view = camera(scene.yaw, scene.pitch);
  const at = fitted(room, view, width, height), shapes = lightShapes(room, at);
  // What is farther from the eye is drawn first.
  const far = dot(room.wall, view.forward) > 0, seen = dot(room.normal, view.forward) < 0;
  const wall = face(room.shapes.wall, at, seen ? "wall" : "wall behind"), part = partShape(room, at, view), lamp = lampShape(room, at);
  const things = dot(room.lamp.at, view.forward) < 0 ? part + shapes.before + lamp : shapes.before + lamp + part;
  svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
  // The second wall takes the first one's place; a frame shows where.
  const second = room.far ? face(room.shapes.second, at, "wall behind second") + beam(room.shapes.landing, room.shapes.second, at, "beam") : "";
  below.innerHTML = floorLines(room, at) + (far ? second + wall : things + shapes.behind + wall + second);
  above.innerHTML = (far ? shapes.behind + things : "") + measures(room, at, view) + names(light, room, at);
  image.setAttribute("transform", picturePlace(room.shapes.picture, at));
  // From behind, the picture shines through the wall.
  image.setAttribute("opacity", seen ? 1 : 0.3);
  if (scene.picture && image.getAttribute("href") !== scene.picture) image.setAttribute("href", scene.picture);
}

function sceneWords(light) {
  if (light.error) return "";
  const { source, screen, lens_size: size } = light.setup, { lamp, mirror, wallMm, far } = layout(light);
  const width = source.size_mm ? ` of ${millimetres(source.size_mm)}` : "", angle = source.angle_mrad ? ` of ${number(source.angle_mrad, 3)} mrad` : "";
  const second = far ? ` A second one of ${sizeText(far.size)} is on a wall ${millimetres(far.mm)} away.` : "";
  const from = lamp.parallel ? `Parallel light${angle}` : `A lamp${width}, ${millimetres(lamp.mm)} before the ${mirror ? "mirror" : "lens"},`;
  const part = mirror ? `a mirror of ${sizeText(size)}` : `a lens of ${sizeText(size)}, at least ${millimetres(light.thickness_mm)} thick`;
  return `${from} shines on ${part}. Its picture of ${sizeText(screen.size)} is on a wall ${millimetres(wallMm)} away.${second}`;
}

// The last scene that could be drawn stays while settings are refused.
function showScene(light, picture) {
  scene.picture = picture;
  if (light && !light.error) {
    scene.light = light;
    setText(find("scene-words"), sceneWords(light));
  }
  drawScene();
}

function turnScene(yaw, pitch) {
  scene.yaw += yaw;
  scene.pitch = Math.min(1.35, Math.max(-0.2, scene.pitch + pitch));
  drawScene();
}

function listenToScene() {
  const frame = find("scene");
  const ways = { ArrowLeft: [1, 0], ArrowRight: [-1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
  frame.addEventListener("keydown", (e) => {
    if (e.ctrlKey || e.metaKey || e.altKey || !(ways[e.key] || e.key === "Home")) return;
    e.preventDefault();
    if (e.key === "Home") Object.assign(scene, kFirstView);
    turnScene(...(ways[e.key] || [0, 0]).map((way) => way * kTurnOfKey));
  });
  let last = null;
  frame.addEventListener("pointerdown", (e) => {
    last = [e.clientX, e.clientY];
    frame.setPointerCapture(e.pointerId);
  });
  frame.addEventListener("pointermove", (e) => {
    if (!last) return;
    turnScene(-kTurnOfPixel * (e.clientX - last[0]), kTurnOfPixel * (e.clientY - last[1]));
    last = [e.clientX, e.clientY];
  });
  for (const end of ["pointerup", "pointercancel"]) frame.addEventListener(end, () => { last = null; });
  new ResizeObserver(drawScene).observe(frame);
}
