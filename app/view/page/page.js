// SPDX-License-Identifier: GPL-3.0-or-later
// The page: controls, the picture as it grows, what it is compared with, and the marked spot.

const find = (name) => document.querySelector(`[data-${name}]`);
const data = JSON.parse(document.getElementById("light-data").textContent);
const optics = readSetup(data.setup, data.front);
const [kColumns, kRows] = optics.pixels;
const targets = [data, data.second].filter((one) => one).map((one) => pictureOf(one.target));

function encoded(light) {
  const x = Math.min(1, Math.max(0, light));
  return x <= 0.0031308 ? 12.92 * x : 1.055 * x ** (1 / 2.4) - 0.055;
}
const fixed = (value, digits) => (digits === 0 ? Math.round(value) : value).toFixed(digits).replace("-", "−");
const signed = (value, digits) => (value < 0 ? "" : "+") + fixed(value, digits);

// ---- Settings ----
// Every control: its values are in its own unit; slide() and value() turn them to and from the
// place of the slider where that is not the value itself.
const lensWidth = Math.max(...data.setup.lens_size);
const nearest = Math.min(1.5 * lensWidth, optics.distance);
const kControls = [
  { group: "Screen", name: "between", words: "From the first picture to the second", start: 0, low: 0, high: 1,
    say: (v, s) => `z = ${fixed(screenAt(optics, s).centre[2], 0)} mm`, two: true },
  { group: "Screen", name: "screenDistance", words: "Distance", start: optics.screenDistance,
    low: 0.25 * optics.screenDistance, high: 2.5 * optics.screenDistance, say: (v) => fixed(v, 0) + " mm", two: false },
  { group: "Screen", name: "screenSize", words: "Size", start: 1, low: 0.5, high: 4,
    say: (v, s) => screenAt(optics, s).size.map((size) => fixed(v * size, 0)).join(" × ") + " mm" },
  { group: "Screen", name: "tiltRight", words: "Tilt, upper edge", start: 0, low: -60, high: 60, say: (v) => fixed(v, 1) + "°" },
  { group: "Screen", name: "tiltUp", words: "Tilt, right edge", start: 0, low: -60, high: 60, say: (v) => fixed(v, 1) + "°" },
  { group: "Lamp", name: "lampDistance", words: "Distance", start: optics.distance, low: 0, high: 1,
    slide: (v) => nearest / v, value: (s) => (s === 0 ? Infinity : nearest / s),
    say: (v) => (v === Infinity ? "parallel light" : fixed(v, 0) + " mm") },
  { group: "Lamp", name: "lampRight", words: "To the right", start: 0, low: -15, high: 15, say: (v) => fixed(v, 1) + "°" },
  { group: "Lamp", name: "lampUp", words: "Up", start: 0, low: -15, high: 15, say: (v) => fixed(v, 1) + "°" },
  { group: "Lamp", name: "lampSize", words: "Size", start: 1e3 * optics.width, low: 0, high: Math.max(40, 2e3 * optics.width),
    say: (v, s) => fixed(v, 1) + " mrad" + (s.lampDistance === Infinity ? "" : ", " + fixed(v * s.lampDistance / 1e3, 1) + " mm") },
  { group: "Lens", name: "turn", words: "Turned", start: 0, low: -30, high: 30, say: (v) => fixed(v, 1) + "°" },
  { group: "Lens", name: "tip", words: "Tipped", start: 0, low: -30, high: 30, say: (v) => fixed(v, 1) + "°" },
  { group: "Lens", name: "index", words: "Refractive index", start: optics.index, low: Math.min(1.3, optics.index),
    high: Math.max(1.9, optics.index), say: (v) => fixed(v, 4), lens: true },
  { group: "Lens", name: "wavelength", words: "Wavelength", start: 587.56, low: 400, high: 700,
    say: (v, s) => fixed(v, 0) + " nm, index " + fixed(indexAt(s.index, s.abbe, v), 4), lens: true },
  { group: "Eye", name: "exposure", words: "Exposure", start: 0, low: -4, high: 4, say: (v) => signed(v, 1) + " stops" },
].filter((control) => !(control.lens && optics.mirror) && (control.two ?? !!optics.second) === !!optics.second);
const kDefaults = { abbe: data.abbe, surface: data.surfaces[0].id, index: optics.index, wavelength: 587.56 };
for (const control of kControls) kDefaults[control.name] = control.start;
const settings = { ...kDefaults };
// What shows another picture of the same light.
const kOnlyShown = new Set(["exposure"]);

const gl = find("wall").getContext("webgl2", { antialias: false, alpha: false, depth: false, preserveDrawingBuffer: true });
const lacking = missingFeature(gl);

function showPlain(why) {
  document.body.classList.add("plain-only");
  find("notice").hidden = false;
  find("notice").textContent = why + ": these are the program's own pictures, which nothing moves.";
}

// ---- The picture as it grows ----
const projector = lacking ? null : new Projector(find("wall"), gl, optics.pixels, data.front);
const decoded = new Map();
const shownOf = () => data.surfaces.find((surface) => surface.id === settings.surface);
let points = [], total = 0, each = 1, asked = false, waiting = [], drawn = null, swing = null, begun = 0;

// Surfaces are unpacked when they are first shown; a promise.
function chosenSurface() {
  const stored = shownOf();
  if (!decoded.has(stored.id)) decoded.set(stored.id, decodeSurface(stored, data.setup.lens_size));
  return decoded.get(stored.id);
}
// What a screen between two is compared with: 0 or 1, the nearer one's picture.
const nearer = () => (settings.between >= 0.5 ? 1 : 0);
const target = () => targets[nearer()];
// True if the program has a picture of these settings: on its second screen, of the design alone.
const asDesigned = () => Object.keys(kDefaults).every((name) => {
  if (name === "between" && settings.between === 1) return settings.surface === kDefaults.surface;
  return kOnlyShown.has(name) || name === "surface" || settings[name] === kDefaults[name];
});
// The program's own picture of the surface that is shown.
const programsPicture = () => pictureOf(stepsTo(settings.surface).pop().picture);
// True if the page shows the program's picture because its own would differ too much.
const onlyStored = () => asDesigned() && !swing && !shownOf().exact;

function halves() {
  return screenAt(optics, settings).size.map((size) => 0.5 * size * settings.screenSize);
}

// The program's picture is shown until the page's own is drawn.
async function begin() {
  const turn = ++begun;
  drawn = null;
  total = 0;
  projector.keep(asDesigned() && !swing ? programsPicture() : null);
  if (projector.still) ask();
  if (onlyStored()) return;
  const surface = await chosenSurface();
  if (projector.still) await shown();
  if (turn !== begun) return;
  if (projector.surface !== surface) projector.setSurface(surface);
  points = sourcePoints(optics, settings.lampSize > 0);
  total = points.length;
  projector.begin(halves());
  ask();
}
// Waits until the browser has shown a frame.
const shown = () => new Promise((resolve) => setTimeout(resolve, 50));

function onePass() {
  const point = points[projector.passes % points.length];
  const placed = placedOptics(optics, settings, point.at);
  projector.pass(placed, point.share, placed.straight ? optics.lensArea : 0);
}

// Light relative to white in the picture: evenly spread it would be as bright as the target's mean.
// A larger screen spreads the same even light thinner.
function gain() {
  const share = settings.between || 0;
  const white = share > 0 ? (1 - share) * data.white + share * data.second.white : data.white;
  return white / settings.screenSize ** 2;
}

function frame() {
  if (!asked) return;
  asked = false;
  const start = performance.now();
  const before = projector.passes;
  for (let i = 0; i < each && projector.passes < total; ++i) onePass();
  const ended = total > 0 ? projector.passes >= total : onlyStored();
  if (ended && !onlyStored()) projector.keep(null);
  if (projector.still || projector.passes > 0) projector.show(2 ** settings.exposure, gain());
  // As many passes as fit a fifteenth of a second.
  const spent = performance.now() - start;
  if (projector.passes > before) each = Math.min(8, spent < 25 ? 2 * each : spent > 70 ? 1 : each);
  if (!lensView.firstPicture) lensView.firstPicture = performance.now();
  find("progress").textContent = ended || swing ? ""
    : total > 1 ? `${projector.passes} of ${total} points of the lamp`
      : projector.still ? "The program's picture, until the page's own is drawn" : "drawing";
  if (ended) finish();
  else if (total > 0) ask();
}
// Passes go on where no frame is shown, in a window behind others.
function ask() {
  if (asked) return;
  asked = true;
  requestAnimationFrame(frame);
  setTimeout(frame, 200);
}

function finish() {
  if (!drawn && !swing) {
    drawn = projector.still ? programsPicture() : projector.picture().map((light) => light * gain());
    compare();
    const done = waiting;
    waiting = [];
    for (const resolve of done) resolve();
  }
  if (swing) {
    const phase = (performance.now() - swing.start) / 5000;
    set("turn", 12 * Math.sin(2 * Math.PI * phase));
    set("tip", 5 * Math.sin(4 * Math.PI * phase));
  }
}

function meanError(a, b) {
  let sum = 0;
  for (let i = 0; i < a.length; ++i) sum += Math.abs(encoded(a[i]) - encoded(b[i]));
  return sum / a.length;
}

function compare() {
  const wanted = target(), errors = new Float32Array(wanted.length);
  for (let i = 0; i < errors.length; ++i) errors[i] = Math.abs(encoded(drawn[i]) - encoded(wanted[i]));
  paintTarget();
  const mean = errors.reduce((a, b) => a + b, 0) / errors.length;
  const top = roundedUp(Math.max(1e-3, errors.slice().sort()[Math.floor(0.995 * (errors.length - 1))]));
  paint(find("difference"), (i) => data.colors[Math.round(255 * Math.min(1, errors[i] / top))]);
  find("top").textContent = String(top);
  find("difference-note").textContent = `between light and target, display values 0 … 1; mean ${fixed(mean, 4)}`;
  let said = `MAE ${fixed(mean, 4)} from the ${kWhich[nearer()]}target`;
  lensView.error = asDesigned() ? meanError(drawn, programsPicture()) : null;
  if (onlyStored()) {
    said += `. This is the program's picture ${shownOf().words}; what the page draws once a control is ` +
            `moved differs from it by MAE ${fixed(shownOf().error, 4)}`;
  } else if (asDesigned()) {
    said += `, ${fixed(lensView.error, 4)} from the program's picture ${shownOf().words}`;
  }
  find("said").textContent = said;
  if (marked) probe();
}
function roundedUp(value) {
  const decade = 10 ** Math.floor(Math.log10(value));
  const step = [1, 2, 5, 10].find((s) => value <= s * decade * (1 + 1e-9));
  return Number((step * decade).toPrecision(1));
}

const kWhich = optics.second ? ["first ", "second "] : [""];
function paintTarget() {
  const wanted = target();
  paint(find("target"), (i) => { const v = Math.round(255 * encoded(wanted[i])); return [v, v, v]; });
  find("target-note").textContent = `the ${kWhich[nearer()]}picture that was asked for`;
}

function paint(canvas, color) {
  canvas.width = kColumns;
  canvas.height = kRows;
  const context = canvas.getContext("2d"), image = context.createImageData(kColumns, kRows);
  for (let i = 0; i < kColumns * kRows; ++i) image.data.set([...color(i), 255], 4 * i);
  context.putImageData(image, 0, 0);
}

// ---- The marked spot ----
let marked = null;  // Shares of the picture, from the left and from the top.

function markAt(x, y) {
  marked = [Math.min(1, Math.max(0, x)), Math.min(1, Math.max(0, y))];
  placeMark();
  if (drawn) probe();
}
function placeMark() {
  const canvas = find("wall"), mark = find("mark");
  mark.hidden = !marked;
  if (!marked) return;
  mark.style.left = canvas.offsetLeft + marked[0] * canvas.offsetWidth + "px";
  mark.style.top = canvas.offsetTop + marked[1] * canvas.offsetHeight + "px";
}

// Groups of places on the lens, brightest first: a place joins the first group that is near.
function grouped(found) {
  const near = 0.04 * lensWidth, groups = [];
  found.sort((a, b) => b.light - a.light);
  for (const place of found) {
    const group = groups.find((g) => Math.hypot(g.x - place.x, g.y - place.y) < near);
    if (!group) groups.push({ ...place });
    else {
      const light = group.light + place.light;
      group.x += (place.x - group.x) * place.light / light;
      group.y += (place.y - group.y) * place.light / light;
      group.light = light;
    }
  }
  return groups.sort((a, b) => b.light - a.light);
}

const stepsTo = (id) => (nearer() ? [data.second]
  : data.chain.slice(0, 1 + data.chain.findIndex((step) => step.surface === id)));
// What each step from the target to the light as drawn adds at a pixel.
function causesAt(pixel) {
  const causes = [];
  let before = target()[pixel];
  for (const step of stepsTo(settings.surface)) {
    const now = pictureOf(step.picture)[pixel];
    causes.push([step.cause, now - before]);
    before = now;
  }
  if (onlyStored()) return causes;
  const others = nearer() && settings.surface !== kDefaults.surface ? "the part and your settings" : "your settings";
  causes.push([asDesigned() ? "the drawing in this page" : others, drawn[pixel] - before]);
  return causes;
}

function probe() {
  if (!projector.surface || projector.surface.id !== settings.surface) {
    chosenSurface().then((surface) => {
      projector.setSurface(surface);
      if (drawn) probe();
    });
    return;
  }
  const column = Math.min(kColumns - 1, Math.floor(marked[0] * kColumns));
  const row = Math.min(kRows - 1, Math.floor(marked[1] * kRows));
  const pixel = row * kColumns + column, [w, h] = halves();
  const at = [((column + 0.5) / kColumns * 2 - 1) * w, (1 - (row + 0.5) / kRows * 2) * h];
  projector.trace(placedOptics(optics, settings, [0, 0]));
  const found = projector.sourcesOf(at, w / kColumns);
  const groups = grouped(found), light = groups.reduce((s, g) => s + g.light, 0);
  const shown = groups.filter((g) => g.light > 0.02 * light).slice(0, 6);
  drawSpots(found, shown);
  const causes = causesAt(pixel);
  const main = causes.reduce((a, b) => (Math.abs(b[1]) > Math.abs(a[1]) ? b : a));
  const places = shown.map((g) => `x ${fixed(g.x, 1)}, y ${fixed(g.y, 1)} mm (${fixed(100 * g.light / light, 0)} %)`);
  const from = places.length ? "Its light leaves the lens at " + places.join("; ") + "." : "No light comes here.";
  const difference = drawn[pixel] - target()[pixel];
  find("probe").hidden = false;
  const words = find("probe-words");
  words.replaceChildren();
  const add = (tag, text, parent = words) => {
    const made = document.createElement(tag);
    made.textContent = text;
    parent.append(made);
    return made;
  };
  add("p", `${from} ` + (Math.abs(difference) < 0.005 ? "It is as bright as the target asks."
    : `It is too ${difference > 0 ? "bright" : "dark"} by ${fixed(Math.abs(difference), 3)} of white, most of it by ${main[0]}.`));
  const table = add("table", "");
  const line = (name, value) => {
    const tr = add("tr", "", table);
    add("td", name, tr);
    add("td", value, tr).className = "number";
  };
  line("light that the target asks for, of white", fixed(target()[pixel], 4));
  for (const [cause, value] of causes) line(cause, signed(value, 4));
  line("light as drawn", fixed(drawn[pixel], 4));
  lensView.spot = { groups: shown, causes, text: words.textContent };
}

function drawSpots(found, groups) {
  const canvas = find("lens"), [width, height] = data.setup.lens_size;
  canvas.width = 600;
  canvas.height = Math.round(600 * height / width);
  const context = canvas.getContext("2d"), scale = 600 / width;
  const place = (p) => [p.x * scale, canvas.height - p.y * scale];
  const most = Math.max(...found.map((p) => p.light), 1e-30);
  for (const p of found) {
    context.fillStyle = `rgba(242, 179, 94, ${0.25 + 0.75 * p.light / most})`;
    context.fillRect(place(p)[0] - 2, place(p)[1] - 2, 4, 4);
  }
  context.strokeStyle = "#f2b35e";
  context.lineWidth = 3;
  for (const g of groups) {
    context.beginPath();
    context.arc(...place(g), 18, 0, 2 * Math.PI);
    context.stroke();
  }
  find("lens-note").textContent = groups.length ? "rings: where the marked spot's light comes from; seen from the screen"
    : "no light comes to the marked spot";
}
