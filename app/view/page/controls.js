// SPDX-License-Identifier: GPL-3.0-or-later
// Sliders, keys and axes, and what other scripts may ask of the page.

const sliders = new Map();

// Refuses what does not exist, in one sentence.
function requireSetting(name, value) {
  const names = (list) => list.join(", ");
  const quoted = (text) => JSON.stringify(String(text));
  if (!Object.hasOwn(settings, name)) {
    throw new Error(`This page has no setting ${quoted(name)}; it has ${names(Object.keys(settings))}.`);
  }
  const surfaces = data.surfaces.map((surface) => surface.id);
  if (name === "surface" && !surfaces.includes(value)) {
    throw new Error(`This page has no surface ${quoted(value)}; it has ${names(surfaces)}.`);
  }
  if (name !== "surface" && (typeof value !== "number" || Number.isNaN(value))) {
    throw new Error(`The setting ${name} must be a number, not ${quoted(value)}.`);
  }
}

function set(name, value) {
  requireSetting(name, value);
  settings[name] = value;
  refresh();
  if (kOnlyShown.has(name)) ask();
  else begin();
  if (name === "screenSize" || name === "between") drawAxes();
}

function refresh() {
  for (const control of kControls) {
    const { row, input, output } = sliders.get(control.name), value = settings[control.name];
    const slide = control.slide ? control.slide(value) : value;
    if (Number(input.value) !== slide) input.value = slide;
    output.textContent = control.say(value, settings);
    input.setAttribute("aria-valuetext", output.textContent);
    row.classList.toggle("changed", value !== control.start);
  }
  for (const radio of find("surfaces").querySelectorAll("input")) radio.checked = radio.value === settings.surface;
}

function makeControl(control, group) {
  const row = document.createElement("label");
  row.className = "control";
  const words = document.createElement("span"), output = document.createElement("output"), input = document.createElement("input");
  words.textContent = control.words;
  Object.assign(input, { type: "range", min: control.low, max: control.high, step: "any" });
  input.addEventListener("input", () => {
    const at = Number(input.value), value = control.value ? control.value(at) : at;
    // The slider catches at the default, and at the second of two screens.
    const start = control.slide ? control.slide(control.start) : control.start;
    const close = (place) => Math.abs(at - place) < 0.008 * (control.high - control.low);
    set(control.name, close(start) ? control.start : control.two && close(control.high) ? control.high : value);
  });
  // Ten steps of the arrow keys for a hundredth would be too many.
  input.addEventListener("keydown", (e) => {
    const way = { ArrowLeft: -1, ArrowDown: -1, ArrowRight: 1, ArrowUp: 1 }[e.key];
    if (!way) return;
    e.preventDefault();
    const next = Number(input.value) + way * (control.high - control.low) / 100;
    input.value = Math.min(control.high, Math.max(control.low, next));
    input.dispatchEvent(new Event("input"));
  });
  row.append(words, output, input);
  group.append(row);
  sliders.set(control.name, { row, input, output });
}

function makeControls() {
  const groups = new Map();
  for (const control of kControls) {
    if (!groups.has(control.group)) {
      const group = document.createElement("fieldset"), legend = document.createElement("legend");
      legend.textContent = control.group;
      group.append(legend);
      find("controls").append(group);
      groups.set(control.group, group);
    }
    makeControl(control, groups.get(control.group));
  }
  for (const surface of data.surfaces) {
    const label = document.createElement("label"), radio = document.createElement("input");
    Object.assign(radio, { type: "radio", name: "surface", value: surface.id });
    radio.addEventListener("change", () => set("surface", surface.id));
    label.append(radio, surface.words);
    find("surfaces").append(label);
  }
  find("surfaces").hidden = data.surfaces.length < 2;
}

function reset() {
  stopSwing();
  Object.assign(settings, kDefaults);
  refresh();
  drawAxes();
  begin();
}
function stopSwing() {
  swing = null;
  find("swing").setAttribute("aria-pressed", "false");
}

// ---- Axes: millimetres on the screen from the picture's middle ----
function drawAxes() {
  const frame = find("frame"), svg = find("axes"), canvas = find("wall");
  const room = frame.parentElement.clientWidth, style = getComputedStyle(frame);
  const left = parseFloat(style.paddingLeft), below = parseFloat(style.paddingBottom);
  const width = Math.min(room - left, 0.8 * window.innerHeight * kColumns / kRows);
  const height = width * kRows / kColumns;
  frame.style.width = left + width + "px";
  canvas.style.height = height + "px";
  const scale = Math.min(2, window.devicePixelRatio || 1);
  canvas.width = Math.round(width * scale);
  canvas.height = Math.round(height * scale);
  const [w, h] = halves(), step = roundedUp(w / (width > 420 ? 4 : 2.5));
  let path = `M${left - 0.5},0V${height + 0.5}H${left + width}`, texts = "";
  for (let n = -Math.floor(w / step); n * step <= w; ++n) {
    const x = left + width * (0.5 + n * step / w / 2);
    path += `M${x},${height}v5`;
    texts += `<text x="${x}" y="${height + 18}" text-anchor="middle">${String(Number((n * step).toPrecision(3))).replace("-", "−")}</text>`;
  }
  for (let n = -Math.floor(h / step); n * step <= h; ++n) {
    const y = height * (0.5 - n * step / h / 2);
    path += `M${left},${y}h-5`;
    texts += `<text x="${left - 9}" y="${y + 4}" text-anchor="end">${String(Number((n * step).toPrecision(3))).replace("-", "−")}</text>`;
  }
  texts += `<text x="${left + width / 2}" y="${height + 36}" text-anchor="middle">right on the screen, mm</text>`;
  if (left > 50) texts += `<text transform="translate(12,${height / 2}) rotate(-90)" text-anchor="middle">up on the screen, mm</text>`;
  svg.innerHTML = `<path d="${path}"/>${texts}`;
  placeMark();
}

function listen() {
  const canvas = find("wall");
  canvas.addEventListener("click", (e) => {
    const box = canvas.getBoundingClientRect();
    markAt((e.clientX - box.left) / box.width, (e.clientY - box.top) / box.height);
  });
  const ways = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1], Enter: [0, 0] };
  canvas.addEventListener("keydown", (e) => {
    const way = ways[e.key];
    if (!way || e.ctrlKey || e.metaKey || e.altKey) return;
    e.preventDefault();
    const [x, y] = marked || [0.5, 0.5], far = e.shiftKey ? 10 : 1;
    markAt(x + far * way[0] / kColumns, y + far * way[1] / kRows);
  });
  find("reset").addEventListener("click", reset);
  find("swing").addEventListener("click", () => {
    if (swing) {
      stopSwing();
      begin();
      return;
    }
    swing = { start: performance.now() };
    find("swing").setAttribute("aria-pressed", "true");
    begin();
  });
  window.addEventListener("resize", () => { drawAxes(); ask(); });
}

// For other scripts: settings by name, and the picture once all passes are done: linear light, 1 is
// white, row 0 on top.
window.lensView = {
  settings: () => ({ ...settings }),
  set,
  reset,
  mark: markAt,
  finished: () => new Promise((resolve) => { drawn ? resolve() : waiting.push(resolve); }),
  picture: () => drawn,
  missing: lacking,
};
const lensView = window.lensView;

paintTarget();
{
  const context = find("scale").getContext("2d");
  data.colors.forEach((color, i) => { context.fillStyle = `rgb(${color})`; context.fillRect(i, 0, 1, 1); });
}
if (lacking) {
  showPlain(lacking);
} else {
  find("plain").hidden = true;
  makeControls();
  refresh();
  drawAxes();
  listen();
  if (!projector.exact) {
    find("notice").hidden = false;
    find("notice").textContent = "This browser adds light in half floats: values are right to about 1 in 1000.";
  }
  begin();
}
