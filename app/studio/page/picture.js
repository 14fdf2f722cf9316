// SPDX-License-Identifier: GPL-3.0-or-later
// Step 1: crop and tone of a picture, and texts as pictures.

const kTones = [
  { name: "black", words: "Black point", low: 0, high: 0.95, start: 0, say: (v) => `${Math.round(100 * v)} %` },
  { name: "white", words: "White point", low: 0.05, high: 1, start: 1, say: (v) => `${Math.round(100 * v)} %` },
  // Sliders are even in the logarithm of gamma.
  { name: "gamma", words: "Gamma", low: Math.log(0.25), high: Math.log(4), start: 0, say: (v) => number(Math.exp(v), 3) },
];
const kCropFields = [["x", "Left"], ["y", "Top"], ["width", "Width"], ["height", "Height"]];
// Fingers and mice catch the frame's edges from so far away, in pixels of the page.
const kCatch = 16;

// The pictures of a project that can be edited, by their names in its state: what they are called, and where what is
// made of them goes.
const kEdited = { picture: ["First picture", "picture"], second: ["Second picture", "second-picture"] };

const editor = { which: "picture", project: null, url: null, image: null, grey: null, crop: null, tone: null, ratio: null, used: null };
const kPlainTone = { black: 0, white: 1, gamma: 0, invert: false, behind: false };

// ---- Tone ----
// sRGB to linear light and back (IEC 61966-2-1).
const kLinear = Float32Array.from({ length: 256 }, (_, v) => (v <= 10.31 ? v / 255 / 12.92 : ((v / 255 + 0.055) / 1.055) ** 2.4));
const encode = (light) => (light <= 0.0031308 ? 12.92 * light : 1.055 * light ** (1 / 2.4) - 0.055);

// Brightness of a part of the picture as displayed, 0 to 255, with the weights of BT.709 in linear light.
function greyOf(image, box, width, height, white) {
  const canvas = make("canvas", { width, height }), context = canvas.getContext("2d", { willReadFrequently: true });
  context.fillStyle = white ? "#fff" : "#000";
  context.fillRect(0, 0, width, height);
  context.imageSmoothingQuality = "high";
  context.drawImage(image, box.x, box.y, box.width, box.height, 0, 0, width, height);
  const from = context.getImageData(0, 0, width, height).data, grey = new Uint8Array(width * height);
  for (let i = 0, k = 0; k < grey.length; i += 4, ++k) {
    const [r, g, b] = [from[i], from[i + 1], from[i + 2]];
    grey[k] = r === g && g === b ? r : Math.round(255 * encode(0.2126 * kLinear[r] + 0.7152 * kLinear[g] + 0.0722 * kLinear[b]));
  }
  return grey;
}

function toneCurve(tone) {
  const reach = Math.max(0.01, tone.white - tone.black);
  return Uint8ClampedArray.from({ length: 256 }, (_, v) => {
    const share = Math.min(1, Math.max(0, (v / 255 - tone.black) / reach)) ** Math.exp(-tone.gamma);
    return 255 * (tone.invert ? 1 - share : share);
  });
}

function tonedPixels(grey, width, height, tone) {
  const pixels = new ImageData(width, height), curve = toneCurve(tone);
  for (let i = 0, k = 0; k < grey.length; i += 4, ++k) {
    pixels.data[i] = pixels.data[i + 1] = pixels.data[i + 2] = curve[grey[k]];
    pixels.data[i + 3] = 255;
  }
  return pixels;
}

// ---- The crop ----
// Crop and tone in one text, to compare them with what is in use.
const editText = () => JSON.stringify([editor.crop, editor.tone]);
const whole = () => ({ x: 0, y: 0, width: editor.image.naturalWidth, height: editor.image.naturalHeight });

function isChanged() {
  const all = whole();
  return kCropFields.some(([name]) => editor.crop[name] !== all[name]) ||
    Object.keys(kPlainTone).some((name) => editor.tone[name] !== kPlainTone[name]);
}

// Keeps a crop inside of the picture, at least 8 pixels wide and high, and in the chosen proportions;
// the corner `held` ([0 or 1, 0 or 1], from the top left) stays where it is.
function fitCrop(crop, held = [0, 0]) {
  const all = whole(), ratio = editor.ratio, least = Math.min(8, all.width, all.height);
  const fixed = [crop.x + held[0] * crop.width, crop.y + held[1] * crop.height];
  const room = [held[0] ? fixed[0] : all.width - fixed[0], held[1] ? fixed[1] : all.height - fixed[1]];
  let width = Math.min(room[0], Math.max(least, crop.width)), height = Math.min(room[1], Math.max(least, crop.height));
  if (ratio) [width, height] = width / height > ratio ? [height * ratio, height] : [width, width / ratio];
  [width, height] = [Math.max(1, Math.round(width)), Math.max(1, Math.round(height))];
  const x = Math.min(all.width - width, Math.max(0, Math.round(fixed[0] - held[0] * width)));
  const y = Math.min(all.height - height, Math.max(0, Math.round(fixed[1] - held[1] * height)));
  return { x, y, width, height };
}

function setCrop(crop, held) {
  editor.crop = fitCrop(crop, held);
  showEditor();
}

// ---- Showing ----
function sizeEditor() {
  const canvas = find("crop"), image = editor.image;
  if (!image) return;
  const room = canvas.parentElement.clientWidth, shape = image.naturalWidth / image.naturalHeight;
  const width = Math.round(Math.min(room, Math.max(200, 0.62 * window.innerHeight) * shape)), height = Math.max(1, Math.round(width / shape));
  if (width < 2 || (editor.grey && canvas.width === width && canvas.height === height)) return;
  Object.assign(canvas, { width, height });
  editor.grey = greyOf(image, whole(), width, height, editor.tone.behind);
  drawEditor();
}

function drawEditor() {
  const canvas = find("crop"), context = canvas.getContext("2d");
  if (!editor.grey) return;
  context.putImageData(tonedPixels(editor.grey, canvas.width, canvas.height, editor.tone), 0, 0);
  const scale = canvas.width / editor.image.naturalWidth, crop = editor.crop;
  const [x, y, w, h] = [crop.x, crop.y, crop.width, crop.height].map((v) => v * scale);
  context.fillStyle = "rgba(8, 8, 10, .68)";
  context.beginPath();
  context.rect(0, 0, canvas.width, canvas.height);
  context.rect(x, y, w, h);
  context.fill("evenodd");
  context.strokeStyle = "#f2b35e";
  context.lineWidth = 1.5;
  context.strokeRect(x + 0.75, y + 0.75, w - 1.5, h - 1.5);
  context.fillStyle = "#f2b35e";
  for (const [cx, cy] of [[x, y], [x + w, y], [x, y + h], [x + w, y + h]]) {
    context.fillRect(Math.min(canvas.width - 9, Math.max(0, cx - 4.5)), Math.min(canvas.height - 9, Math.max(0, cy - 4.5)), 9, 9);
  }
  drawHistogram();
}

// How often each brightness occurs, by the square root, with black and white point.
function drawHistogram() {
  const canvas = find("histogram"), context = canvas.getContext("2d"), counts = new Float32Array(256);
  for (const v of editor.grey) counts[v] += 1;
  const most = Math.sqrt(Math.max(...counts.subarray(1, 255), 1));
  context.clearRect(0, 0, 256, 48);
  context.fillStyle = "#8d8a82";
  counts.forEach((count, v) => context.fillRect(v, 48, 1, -Math.min(48, 46 * Math.sqrt(count) / most)));
  context.fillStyle = "#f2b35e";
  for (const point of [editor.tone.black, editor.tone.white]) context.fillRect(Math.min(254, 255 * point), 0, 1.5, 48);
}

function showEditor() {
  for (const [name] of kCropFields) {
    const input = document.getElementById(`crop-${name}`);
    if (document.activeElement !== input) input.value = editor.crop[name];
  }
  for (const tone of kTones) {
    const input = document.getElementById(`tone-${tone.name}`), words = tone.say(editor.tone[tone.name]);
    if (Number(input.value) !== editor.tone[tone.name]) input.value = editor.tone[tone.name];
    setText(input.previousElementSibling, words);
    setAttribute(input, "aria-valuetext", words);
  }
  find("invert").checked = editor.tone.invert;
  find("white").checked = editor.tone.behind;
  find("use").disabled = !isChanged() || editText() === editor.used;
  setText(find("use"), editText() === editor.used && isChanged() ? "This crop and tone is in use" : "Use this crop and tone");
  setAttribute(find("crop"), "aria-label", `The picture; the crop is ${editor.crop.width} × ${editor.crop.height} pixels, ${editor.crop.x} from the left, ${editor.crop.y} from the top`);
  drawEditor();
}

// ---- Loading ----
// What was last used comes back after a reload.
const editKey = () => `lensforge ${page.folder} ${editor.project} ${editor.url}`;
function storedEdit() {
  try {
    const stored = JSON.parse(localStorage.getItem(editKey()));
    return stored && stored.width === editor.image.naturalWidth && stored.height === editor.image.naturalHeight ? stored : null;
  } catch (e) {
    return null;
  }
}
function storeEdit() {
  const { crop, tone, image } = editor;
  editor.used = editText();
  try {
    localStorage.setItem(editKey(), JSON.stringify({ crop, tone, width: image.naturalWidth, height: image.naturalHeight }));
  } catch (e) {
    // A browser that keeps nothing only forgets the frame.
  }
}

function hasAlpha(image) {
  const canvas = make("canvas", { width: 64, height: 64 }), context = canvas.getContext("2d");
  context.drawImage(image, 0, 0, 64, 64);
  return context.getImageData(0, 0, 64, 64).data.some((v, i) => i % 4 === 3 && v < 250);
}

function startEditor(image) {
  editor.image = image;
  const stored = storedEdit();
  Object.assign(editor, { grey: null, ratio: null, crop: stored ? stored.crop : whole(), tone: stored ? stored.tone : { ...kPlainTone } });
  editor.used = stored ? editText() : null;
  find("aspect").value = "";
  if (editor.which === "second" && !stored) cropAsFirst();
  setHidden(find("white-row"), !hasAlpha(image));
  sizeEditor();
  showEditor();
}

// The proportions of the picture that the other one goes with; both must have the same.
const firstRatio = () => page.state.picture.width / page.state.picture.height;

// The largest part of a second picture in the first one's proportions, in its middle.
function cropAsFirst() {
  find("aspect").value = "other";
  editor.ratio = firstRatio();
  const all = whole(), fit = fitCrop(all);
  editor.crop = { ...fit, x: Math.round((all.width - fit.width) / 2), y: Math.round((all.height - fit.height) / 2) };
}

function edit(which) {
  editor.which = which;
  showPictureStep(page.state);
}

function showWhich(state) {
  if (!state.second) editor.which = "picture";
  setHidden(find("which"), !state.second);
  setHidden(find("aspect-other"), editor.which !== "second");
  rebuild(find("which"), editor.which, (now) => Object.entries(kEdited).map(([which, [words]]) =>
    make("button", { type: "button", "data-key": which, "aria-pressed": String(which === now), text: words, onclick: () => edit(which) })));
  setHidden(find("second-fields"), !state.second);
}

function loadEditor(state) {
  const url = state[editor.which] && state[editor.which].preview;
  if (editor.project === state.name && editor.url === url) return;
  Object.assign(editor, { project: state.name, url, image: null, grey: null });
  if (!url) return;
  const image = new Image();
  image.onload = () => { if (editor.url === url && editor.project === state.name) startEditor(image); };
  image.src = url;
}

function showPictureStep(state) {
  showWhich(state);
  loadEditor(state);
  const picture = state[editor.which];
  setText(find("picture-size"), picture && picture.ready ? `In use: ${picture.width} × ${picture.height} pixels` : "No picture is in use yet");
  setText(find("picture-changes"), picture && picture.changes.length ? `· ${picture.changes.join("; ")}` : "");
  find("original").classList.toggle("first", Boolean(picture) && !picture.ready);
}

// ---- Sending ----
const pngOf = (canvas) => new Promise((resolve) => canvas.toBlob(resolve, "image/png"));

async function usePicture() {
  const { width, height } = editor.crop, canvas = make("canvas", { width, height });
  const grey = greyOf(editor.image, editor.crop, width, height, editor.tone.behind);
  canvas.getContext("2d").putImageData(tonedPixels(grey, width, height, editor.tone), 0, 0);
  if (await act(1, kEdited[editor.which][1], await pngOf(canvas))) {
    storeEdit();
    showEditor();
    say("The cropped and toned picture is in use.");
  }
}

async function useOriginal() {
  if (!await act(1, kEdited[editor.which][1], undefined)) return;
  say("The original is in use as it is.");
  if (!editor.image) return;
  Object.assign(editor, { grey: null, ratio: null, crop: whole(), tone: { ...kPlainTone } });
  find("aspect").value = "";
  storeEdit();
  sizeEditor();
  showEditor();
}

// A second picture is in use as it is, and is cropped where its proportions differ.
async function useSecond() {
  const input = find("second-file"), [file] = input.files;
  input.value = ""; // So that the same file can be chosen again.
  if (!file || !await act(1, `second?title=${encodeURIComponent(file.name)}`, file)) return;
  say("The second picture is in use.");
  edit("second");
}

// ---- Dragging ----
// What the pointer has caught: sides that move (−1, 0 or 1 across and down), the middle, or nothing.
function caught(x, y) {
  const scale = find("crop").getBoundingClientRect().width / editor.image.naturalWidth, { crop } = editor;
  const side = (at, from, length) => {
    const [low, high] = [Math.abs(at - from * scale), Math.abs(at - (from + length) * scale)];
    if (Math.min(low, high) < kCatch) return low < high ? -1 : 1;
    return at > from * scale && at < (from + length) * scale ? 0 : null;
  };
  const across = side(x, crop.x, crop.width), down = side(y, crop.y, crop.height);
  if (across === null || down === null) return null;
  return { across, down, moves: !across && !down };
}

function dragged(start, dx, dy) {
  const { crop, grip } = start, all = whole();
  if (grip.moves) {
    const x = Math.min(all.width - crop.width, Math.max(0, crop.x + dx)), y = Math.min(all.height - crop.height, Math.max(0, crop.y + dy));
    return setCrop({ ...crop, x, y });
  }
  const left = grip.across < 0 ? Math.max(-crop.x, Math.min(crop.width - 8, dx)) : 0, top = grip.down < 0 ? Math.max(-crop.y, Math.min(crop.height - 8, dy)) : 0;
  const next = { x: crop.x + left, y: crop.y + top, width: crop.width - left + (grip.across > 0 ? dx : 0), height: crop.height - top + (grip.down > 0 ? dy : 0) };
  // An edge in fixed proportions takes the other direction along.
  if (editor.ratio && !grip.down) next.height = next.width / editor.ratio;
  if (editor.ratio && !grip.across) next.width = next.height * editor.ratio;
  return setCrop(next, [grip.across < 0 ? 1 : 0, grip.down < 0 ? 1 : 0]);
}

function listenToCrop() {
  const canvas = find("crop");
  let start = null;
  const place = (e) => {
    const box = canvas.getBoundingClientRect();
    return [e.clientX - box.left, e.clientY - box.top, editor.image.naturalWidth / box.width];
  };
  canvas.addEventListener("pointerdown", (e) => {
    if (!editor.image) return;
    const [x, y, pixel] = place(e), grip = caught(x, y);
    if (!grip && e.pointerType === "touch") return;
    canvas.setPointerCapture(e.pointerId);
    start = { x, y, pixel, crop: editor.crop, grip };
    if (!grip) Object.assign(start, { crop: { x: Math.round(x * pixel), y: Math.round(y * pixel), width: 8, height: 8 }, grip: { across: 1, down: 1 } });
  });
  canvas.addEventListener("pointermove", (e) => {
    if (!start) return;
    const [x, y] = place(e);
    dragged(start, Math.round((x - start.x) * start.pixel), Math.round((y - start.y) * start.pixel));
  });
  for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, () => { start = null; });
  // A finger scrolls the page except where it has caught the frame's edges, or a frame that is smaller than the picture.
  canvas.addEventListener("touchstart", (e) => {
    const box = canvas.getBoundingClientRect(), touch = e.touches[0];
    const grip = editor.image && caught(touch.clientX - box.left, touch.clientY - box.top);
    if (grip && !(grip.moves && editor.crop.width === editor.image.naturalWidth)) e.preventDefault();
  }, { passive: false });
}

// ---- Fields ----
function makeEditor() {
  for (const [name, words] of kCropFields) {
    const input = make("input", { id: `crop-${name}`, type: "number", min: 0, step: 1, inputmode: "numeric", onchange: () => cropTyped(name, Number(input.value)) });
    find("crop-fields").append(make("div", { class: "field" }, make("label", { for: input.id, text: words }), input));
  }
  for (const tone of kTones) {
    const input = make("input", { id: `tone-${tone.name}`, type: "range", min: tone.low, max: tone.high, step: 0.01, value: tone.start,
      oninput: () => { editor.tone[tone.name] = Number(input.value); showEditor(); } });
    find("tone").append(make("div", { class: "control" }, make("label", { for: input.id, text: tone.words }), make("output", { for: input.id }), input));
  }
  find("invert").addEventListener("change", (e) => { editor.tone.invert = e.target.checked; showEditor(); });
  find("white").addEventListener("change", (e) => { editor.tone.behind = e.target.checked; editor.grey = null; sizeEditor(); showEditor(); });
  find("aspect").addEventListener("change", chooseAspect);
  find("use").addEventListener("click", usePicture);
  find("original").addEventListener("click", useOriginal);
  find("second-file").addEventListener("change", useSecond);
  listenToCrop();
  new ResizeObserver(sizeEditor).observe(find("crop").parentElement);
}

function cropTyped(name, value) {
  if (!editor.image || !Number.isFinite(value)) return;
  const next = { ...editor.crop, [name]: value }, ratio = editor.ratio;
  if (ratio && name === "width") next.height = value / ratio;
  if (ratio && name === "height") next.width = value * ratio;
  setCrop(next);
}

function chooseAspect() {
  const chosen = find("aspect").value, all = editor.image && whole();
  if (!all) return;
  editor.ratio = chosen === "own" ? all.width / all.height : chosen === "other" ? firstRatio() : Number(chosen) || null;
  setCrop(editor.crop);
}
