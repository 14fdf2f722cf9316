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

// The corners of a rectangle across the light, as a viewer in front of the wall reads: from the top left.
function rectangle(size, z) {
  const [w, h] = [size[0] / 2, size[1] / 2];
  return [[w, h, z], [-w, h, z], [-w, -h, z], [w, -h, z]];
}

// ---- What there is, in millimetres ----
function layout(light) {
  const largest = Math.max(...light.lens_mm, ...light.picture_mm);
  const drawn = (distance) => Math.min(distance, kFarthest * largest);
  const wall = drawn(light.focal_mm);
  const lamp = light.lamp_mm === null ? 0.75 * wall : drawn(light.lamp_mm);
  const lampSize = light.lamp_mm === null ? light.lens_mm : [light.lamp_width_mm || 0, light.lamp_width_mm || 0];
  return { largest, wall, lamp, lampSize, floor: -0.62 * Math.max(light.lens_mm[1], light.picture_mm[1]),
    side: 0.62 * Math.max(light.lens_mm[0], light.picture_mm[0]), thick: Math.min(light.thickness_mm, 0.4 * wall) };
}

const lineWords = (distance, drawn) => millimetres(distance) + (drawn < distance ? ", drawn shorter" : "");

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
  const from = -room.lamp, to = room.wall, step = (to - from) / 8, wide = room.side;
  let lines = "";
  for (let i = 0; i <= 8; ++i) lines += line([-wide, room.floor, from + i * step], [wide, room.floor, from + i * step], at, "floor");
  for (let i = -2; i <= 2; ++i) lines += line([i * wide / 2, room.floor, from], [i * wide / 2, room.floor, to], at, "floor");
  return lines;
}

function lensShape(light, room, at) {
  const back = rectangle(light.lens_mm, 0), front = rectangle(light.lens_mm, room.thick);
  return face(back, at, "glass") + beam(back, front, at, "glass") + face(front, at, "glass lit");
}

function lampShape(light, room, at) {
  if (light.lamp_mm === null) return rectangle(light.lens_mm, -room.lamp).map((corner) => line(corner, [corner[0], corner[1], 0], at, "ray")).join("");
  const [x, y] = at([0, 0, -room.lamp]).split(",");
  const edge = at([room.lampSize[0] / 2, 0, -room.lamp]).split(","), up = at([0, room.lampSize[1] / 2, -room.lamp]).split(",");
  const radius = Math.max(3, Math.hypot(edge[0] - x, edge[1] - y), Math.hypot(up[0] - x, up[1] - y));
  return `<circle class="glow" cx="${x}" cy="${y}" r="${3.2 * radius}"/><circle class="bulb" cx="${x}" cy="${y}" r="${radius}"/>`;
}

function lightShapes(light, room, at) {
  const lens = rectangle(light.lens_mm, 0), out = rectangle(light.lens_mm, room.thick), wall = rectangle(light.picture_mm, room.wall);
  const start = light.lamp_mm === null ? rectangle(light.lens_mm, -room.lamp) : rectangle(room.lampSize, -room.lamp);
  const rays = out.map((corner, i) => line(corner, wall[i], at, "ray")).join("");
  return { before: beam(start, lens, at, "beam"), behind: beam(out, wall, at, "beam") + rays };
}

// Distances stand on the floor, on the side that is nearer to the eye.
function measures(light, room, at, view) {
  const x = (view.forward[0] > 0 ? -1 : 1) * room.side, y = room.floor;
  const bar = (from, to) => [[x, y, from], [x, y, to]].map((p) => line([0.94 * p[0], y, p[2]], [1.06 * p[0], y, p[2]], at, "measure")).join("") +
    line([x, y, from], [x, y, to], at, "measure");
  const middle = (from, to) => [1.1 * x, y, (from + to) / 2];
  const lampWords = light.lamp_mm === null ? "parallel light" : lineWords(light.lamp_mm, room.lamp);
  return (light.lamp_mm === null ? "" : bar(-room.lamp, 0)) + bar(0, room.wall) + label(middle(-room.lamp, 0), at, lampWords, "", 18) +
    label(middle(0, room.wall), at, lineWords(light.focal_mm, room.wall), "", 18);
}

// Names stand above the highest corner of their thing.
function nameAbove(size, z, at, words) {
  const corners = rectangle(size, z).map((p) => at(p).split(",").map(Number));
  const x = corners.reduce((sum, p) => sum + p[0] / 4, 0), y = Math.min(...corners.map((p) => p[1])) - 10;
  return textAt(x, y, words, "named");
}

function names(light, room, at) {
  const lamp = light.lamp_mm === null ? "" : label([0, room.lampSize[1] / 2, -room.lamp], at,
    light.lamp_width_mm ? `lamp ${millimetres(light.lamp_width_mm)}` : "lamp", "named", -16);
  return lamp + nameAbove(light.lens_mm, 0, at, `lens ${sizeText(light.lens_mm)}`) +
    nameAbove(light.picture_mm, room.wall, at, `picture ${sizeText(light.picture_mm)}`);
}

// ---- Drawing ----
// The picture stays in the document; all else is drawn anew, below and above it.
const kSceneParts = `<defs><radialGradient id="glow"><stop offset="0" stop-color="#ffe2a8"/>
  <stop offset=".3" stop-color="#f2b35e" stop-opacity=".5"/><stop offset="1" stop-color="#f2b35e" stop-opacity="0"/></radialGradient></defs>
  <g></g><image width="1" height="1" preserveAspectRatio="none"/><g></g>`.replace(/>\s+</g, "><");

// Fits everything that is measured into the frame, whatever the angle.
function fitted(light, room, view, width, height) {
  const middle = (room.wall - room.lamp) / 2, distance = 4 * Math.max(room.wall + room.lamp, room.largest);
  const points = [...rectangle([2.1 * room.side, 2 * -room.floor], room.wall), ...rectangle([2.1 * room.side, 2 * -room.floor], 0),
    [-1.1 * room.side, room.floor, -room.lamp], [1.1 * room.side, room.floor, -room.lamp], [0, room.lampSize[1] / 2, -room.lamp]];
  const flat = points.map((p) => project(p, view, middle, distance));
  const bounds = [0, 1].map((axis) => [Math.min(...flat.map((p) => p[axis])), Math.max(...flat.map((p) => p[axis]))]);
  const scale = Math.min((width - 70) / (bounds[0][1] - bounds[0][0]), (height - 76) / (bounds[1][1] - bounds[1][0]));
  const offset = [width / 2 - scale * (bounds[0][0] + bounds[0][1]) / 2, height / 2 - scale * (bounds[1][0] + bounds[1][1]) / 2];
  return (point) => {
    const p = project(point, view, middle, distance);
    return `${(offset[0] + scale * p[0]).toFixed(2)},${(offset[1] + scale * p[1]).toFixed(2)}`;
  };
}

// The affine map that is nearest to the perspective of the picture's corners.
function picturePlace(light, room, at) {
  const [a, b, c, d] = rectangle(light.picture_mm, room.wall).map((p) => at(p).split(",").map(Number));
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
  const at = fitted(light, room, view, width, height), shapes = lightShapes(light, room, at), seen = view.forward[2] > 0;
  const wall = face(rectangle([2 * room.side, -2 * room.floor], room.wall), at, seen ? "wall" : "wall behind");
  const lens = lensShape(light, room, at), lamp = lampShape(light, room, at);
  const words = measures(light, room, at, view) + names(light, room, at);
  svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
  below.innerHTML = floorLines(room, at) + (seen ? wall : shapes.before + lamp + lens + shapes.behind + wall);
  above.innerHTML = (seen ? shapes.behind + lens + shapes.before + lamp : "") + words;
  image.setAttribute("transform", picturePlace(light, room, at));
  // From behind, the picture shines through the wall.
  image.setAttribute("opacity", seen ? 1 : 0.3);
  if (scene.picture && image.getAttribute("href") !== scene.picture) image.setAttribute("href", scene.picture);
}

function sceneWords(light) {
  if (light.error) return "";
  const lamp = light.lamp_mm === null ? "Parallel light" : `A lamp${light.lamp_width_mm ? ` of ${millimetres(light.lamp_width_mm)}` : ""}, ${millimetres(light.lamp_mm)} before the lens,`;
  const angle = light.lamp_angle_rad ? ` of ${number(1e3 * light.lamp_angle_rad, 3)} mrad` : "";
  return `${lamp}${light.lamp_mm === null ? angle : ""} shines on a lens of ${sizeText(light.lens_mm)}, at least ${millimetres(light.thickness_mm)} thick. ` +
    `Its picture of ${sizeText(light.picture_mm)} is on a wall ${millimetres(light.focal_mm)} away.`;
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
