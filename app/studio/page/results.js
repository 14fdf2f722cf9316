// SPDX-License-Identifier: GPL-3.0-or-later
// What the steps show of plan, lens and part: proposals, pictures, figures, files, commands.

const soft = (text) => make("span", { class: "soft", text });

function figure({ words, url }) {
  const link = make("a", { href: url, target: "_blank", rel: "noopener", "data-key": url }, make("img", { src: url, alt: words }));
  return make("figure", {}, link, make("figcaption", { text: words }));
}
function fileRow({ name, words, url, bytes }) {
  const short = name.split("/").pop();
  return make("li", {}, make("a", { href: url, download: short, "data-key": url, text: short }), " ", soft([words, bytesText(bytes)].filter(Boolean).join(", ")));
}
function reportRow(url, words) {
  const link = make("a", { href: url, target: "_blank", rel: "noopener", "data-key": url, text: "Report" });
  return make("li", {}, link, " ", soft(`${words}, opens in a new tab`));
}
const fact = (name, value) => make("div", {}, make("dt", { text: name }), make("dd", { text: value }));

const sentence = (text) => `${text[0].toUpperCase()}${text.slice(1).replace(/\.$/, "")}.`;

// ---- Step 2: blur and proposals ----
const blurs = { shown: new Map() };

function showBlur(light, picture) {
  if (!light || light.error) return;
  rebuild(find("causes"), light.blurs.map((blur) => blur.cause), (causes) => causes.map((cause) => {
    const box = make("input", { type: "checkbox", "data-key": cause, onchange: () => { blurs.shown.set(cause, box.checked); drawBlur(); } });
    box.checked = blurs.shown.get(cause) !== false;
    return make("label", { class: "check" }, box, make("span", {}, cause, " ", make("b", { "data-cause": cause })));
  }));
  for (const blur of light.blurs) setText(find("causes").querySelector(`[data-cause="${CSS.escape(blur.cause)}"]`), number(blur.pixels, 2));
  setText(find("sharp"), `${Math.round(light.sharp_pixels)} of ${Math.max(...light.pixels)} pixels on the longer side stay sharp. ${light.words || ""}`.trim());
  drawBlur(light, picture);
}

// Widths of Gaussians at half their height; they add by squares. SVG blurs in linear light, as lamps do.
function drawBlur(light = page.state.light, picture = page.state.picture && page.state.picture.url) {
  const svg = find("blur"), image = svg.querySelector("image"), filter = svg.querySelector("filter"), [width, height] = light.pixels;
  const width2 = light.blurs.filter((blur) => blurs.shown.get(blur.cause) !== false).reduce((sum, blur) => sum + blur.pixels ** 2, 0);
  setAttribute(svg, "viewBox", `0 0 ${width} ${height}`);
  for (const node of [image, filter]) for (const [name, value] of Object.entries({ x: 0, y: 0, width, height })) setAttribute(node, name, value);
  setAttribute(filter.firstElementChild, "stdDeviation", (Math.sqrt(width2) / 2.355).toFixed(3));
  if (picture) setAttribute(image, "href", picture);
}

const hoursText = (operations) => operations.map((o) => `${o.name} ${minutesText(o.minutes)}`).join(", ");

function proposalFacts(p) {
  return [["Lens", `${number(p.width_mm)} mm wide`], ["Wall", `at ${millimetres(p.focal_mm)}`],
    ["Picture", `${number(p.image_width_mm)} mm wide`], ["Pixels", `${p.pixels}, ${Math.round(p.sharp_pixels)} sharp`],
    ["MAE of the part", number(p.mae, 2)], ["Leakage", percent(p.leakage)], ["Contrast", p.contrast ? `${Math.round(p.contrast)} : 1` : "–"],
    ["Relief", millimetres(Number(p.relief_mm.toPrecision(2)))], ["Sheet", p.sheet_mm ? millimetres(p.sheet_mm) : "none is thick enough"],
    ["On the machine", minutesText(p.minutes)], ["Design", `about ${minutesText(p.design_seconds / 60)}`]];
}

const isTaken = (p, settings) => Object.entries(p.settings).every(([name, value]) => settings[name] === value);

function proposalCard(p, settings) {
  const taken = isTaken(p, settings), words = taken ? "Taken" : "Take this";
  const take = async () => {
    if (await act(2, "settings", { settings: p.settings, workshop: {} })) say(`Sizes of the proposal “${p.title}” are set.`);
  };
  return make("article", { class: taken ? "card taken" : "card" },
    make("h4", { text: p.title[0].toUpperCase() + p.title.slice(1) }), make("p", { class: "soft", text: p.words || "Keeps to what you gave." }),
    make("dl", {}, ...proposalFacts(p).map(([name, value]) => fact(name, value))), make("p", { class: "soft operations", text: hoursText(p.operations) }),
    make("button", { type: "button", "data-key": `take ${p.title}`, "aria-label": `${words}: ${p.title}`, "aria-pressed": String(taken), text: words, onclick: take }));
}

function showPlan(state) {
  const proposals = state.plan ? state.plan.proposals : [];
  setHidden(find("plan-note"), state.settings["--faces"] !== "two" && !state.settings["--second"]);
  rebuild(find("proposals"), [proposals, proposals.map((p) => isTaken(p, state.settings))], ([list]) => list.map((p) => proposalCard(p, state.settings)));
}

// ---- Step 3: the lens ----
function showLive(job, state) {
  const live = job && job.step === "design" && job.live && job.status !== "done" ? job.live : null;
  setHidden(find("live"), !live);
  if (!live) return false;
  setPicture(find("live-picture"), live.picture);
  setPicture(find("live-error"), live.error);
  setPicture(find("live-second"), live.second);
  setHidden(find("live-far"), !live.second);
  setPicture(find("live-target"), state.picture && state.picture.url);
  setText(find("live-words"), `${live.rounds ? `after round ${live.rounds}` : "before the first round"}, MAE ${live.mae.toFixed(4)}`);
  if (built.get(find("live-plot")) !== live.plot) find("live-plot").innerHTML = live.plot;
  built.set(find("live-plot"), live.plot);
  return true;
}

function showLens(state) {
  const lens = state.lens, live = showLive(state.job, state), versions = state.versions || [];
  setHidden(find("lens"), !lens || live);
  setHidden(find("lens-empty"), Boolean(lens) || live);
  find("undo").disabled = !state.can_undo;
  find("redo").disabled = !state.can_redo;
  setText(find("version"), lens ? `version ${lens.version}${versions.length > 1 ? ` of ${versions.length}` : ""}${lens.status === "interrupted" ? ", not finished" : ""}` : "");
  if (!lens) return;
  rebuild(find("lens-words"), lens.words, ([first, ...rest]) => [make("span", { class: "sentence", text: first || "" }),
    ...rest.map((text) => make("span", { class: "row soft", text }))]);
  rebuild(find("lens-pictures"), lens.pictures, (list) => list.map(figure));
  rebuild(find("lens-files"), lens.files, (list) => list.map(fileRow));
  rebuild(find("versions"), [versions, lens.version], ([list, now]) => list.map((v) => make("li", { value: v.version, "aria-current": v.version === now ? "true" : null, text: v.words })));
  setHidden(find("versions-box"), versions.length < 2);
  if (lens.view) setAttribute(find("view-link"), "href", lens.view);
  setHidden(find("view-link"), !lens.view);
}

// ---- Step 4: the part ----
// The MAE on a line with the range in which four of five parts are.
function rangeDrawing(mae, range) {
  const most = 1.25 * Math.max(mae, range.p90), x = (value) => (200 * value / most).toFixed(1);
  const drawing = make("span", { class: "range", "aria-hidden": "true" });
  drawing.innerHTML = `<svg viewBox="-6 0 212 30"><path d="M0,15H200"/><path class="span" d="M${x(range.p10)},15H${x(range.p90)}"/>` +
    `<path class="ends" d="M${x(range.p10)},8v14M${x(range.p90)},8v14"/><circle cx="${x(mae)}" cy="15" r="5"/></svg>`;
  return drawing;
}

function partFigures(part) {
  const one = (name, value, ...more) => make("div", {}, soft(name), make("b", { text: value }), ...more);
  const { mae, range } = part;
  const spread = range ? [rangeDrawing(mae, range), soft(`P10–P90 ${number(range.p10, 3)}–${number(range.p90, 3)}${part.model === "waves" ? " by rays" : ""}: four of five parts`)] : [soft(part.range_words)];
  return [
    one("MAE from the picture", number(mae, 3), ...spread),
    one("Leakage", percent(part.leakage), soft("light beyond the design’s")),
    part.contrast ? one("Contrast", `${Math.round(part.contrast)} : 1`, soft("light to dark")) : null,
    one("On the machine", minutesText(part.minutes), soft(hoursText(part.operations || []))),
  ].filter(Boolean);
}

// A lens with a shaped front is cut in two setups, of the front first; any other in one.
const kSetups = [["front", "The front: setup 1 of 2"], ["part", "The back: setup 2 of 2"]];
const parts = new Map();
const kCutHints = ["computes the programs and predicts the part; nothing moves yet",
  "the front first, into the flat blank; then the back, with the blank turned over onto the frame that stays around the front. Nothing moves yet."];

function makeParts() {
  for (const [key, title] of kSetups) {
    const block = {
      title: make("h4", { class: "setup", text: title }), old: make("p", { class: "notice", text: "This part was made from another version or workshop. Cut again to bring it up to date." }),
      verdict: make("p", { class: "sentence", "data-verdict": true }), figures: make("div", { class: "figures", "data-figures": true }), faces: make("ul", { class: "list" }),
      warnings: make("div", { class: "warned" }), pictures: make("div", { class: "strip" }), files: make("ul", { class: "files", "data-part-files": true }),
    };
    const root = make("div", { "data-part": key, hidden: true }, ...Object.values(block));
    parts.set(key, { root, ...block });
    find("parts").append(root);
  }
}

function showSetup({ root, title, old, verdict, figures, faces, warnings, pictures, files }, part, twoFaces) {
  setHidden(root, !part);
  if (!part) return;
  setHidden(title, !twoFaces);
  setHidden(old, part.current !== false);
  setText(verdict, part.verdict || "");
  rebuild(figures, [part.mae, part.range, part.leakage, part.contrast, part.minutes, part.operations], () => partFigures(part));
  rebuild(faces, part.faces, (list) => list.map((text) => make("li", { text: sentence(text) })));
  setHidden(faces, !part.faces.length);
  rebuild(warnings, part.warnings, (list) => (list.length
    ? [make("h4", { text: list.length === 1 ? "A warning" : `${list.length} warnings` }), make("ul", {}, ...list.map((text) => make("li", { text })))] : []));
  rebuild(pictures, part.pictures, (list) => list.map(figure));
  rebuild(files, [part.report, part.files], ([report, list]) => [reportRow(report, "all figures of the part"), ...list.map(fileRow)]);
}

function showPart(state) {
  const twoFaces = Boolean(state.lens && state.lens.two_faces);
  for (const [key, block] of parts) showSetup(block, state[key], twoFaces);
  setHidden(find("part-empty"), Boolean(state.part || state.front));
  setHidden(document.querySelector('[data-run="cam-front"]'), !twoFaces);
  setText(find("cut-button"), twoFaces ? "Cut the back" : "Cut");
  setText(find("cut-words"), kCutHints[Number(twoFaces)]);
}

// ---- A photograph of the wall ----
async function checkPhoto() {
  const photo = find("photo"), [file] = photo.files;
  photo.value = ""; // So that the same file can be chosen again.
  if (file && await act(4, "photo", file)) await act(4, "run", { step: "check" });
}

function showCheck(state) {
  const check = state.check;
  setHidden(find("check"), !check);
  if (!check) return;
  setText(find("check-verdict"), `${check.verdict}.`);
  rebuild(find("check-more"), check.more, (list) => list.map((text) => make("li", { text: `Perhaps also: ${text}.` })));
  rebuild(find("check-pictures"), check.pictures, (list) => list.map(figure));
  rebuild(find("check-files"), check.report, (report) => [reportRow(report, "all that the photograph shows")]);
}

// ---- Commands ----
async function copyCommand(button, text) {
  const code = button.previousElementSibling;
  try {
    await navigator.clipboard.writeText(text);
    setText(button, "Copied");
    say("The command is copied.");
  } catch (e) {
    getSelection().selectAllChildren(code);
    setText(button, "Selected");
  }
  setTimeout(() => setText(button, "Copy"), 1500);
}

function commandRow([name, text]) {
  const copy = make("button", { type: "button", "data-key": `copy ${name}`, "aria-label": `Copy the ${name} command`, text: "Copy", onclick: () => copyCommand(copy, text) });
  return make("div", { class: "code" }, make("code", { text }), copy);
}

function showCommands(commands) {
  for (const box of document.querySelectorAll("[data-commands]")) {
    const given = box.dataset.commands.split(" ").filter((name) => commands && commands[name]).map((name) => [name, commands[name]]);
    rebuild(box, given, (list) => (list.length ? list.map(commandRow) : [make("p", { class: "soft", text: "It appears once there is something to do." })]));
  }
}
