// SPDX-License-Identifier: GPL-3.0-or-later
// The page as a whole: projects, steps, jobs, and the server's state.

const kQuick = 500; // ms between questions while something runs
const kSlow = 2000;
const kStepOfJob = { plan: 2, design: 3, view: 3, "cam-front": 4, cam: 4, export: 4, check: 4 };
const kJobWords = { plan: "Plan", design: "Design", view: "View", "cam-front": "Cut of the front", cam: "Cut", export: "Export", check: "Check" };
const kActive = new Set(["waiting", "running", "stopping"]);
const kStepNames = ["Picture", "Light and size", "Lens", "Part", "Machine"];

// ---- Jobs ----
const strips = new Map();
function makeStrip(step) {
  const bar = make("div", { class: "bar", role: "progressbar", "aria-label": `Progress of step ${step}`, "aria-valuemin": 0, "aria-valuemax": 100 }, make("span"));
  const words = make("span", { class: "words" });
  const pause = make("button", { type: "button", text: "Pause", onclick: () => act(step, "pause") });
  const go = make("button", { type: "button", text: "Continue", onclick: () => act(step, "continue") });
  const root = document.querySelector(`[data-job="${step}"]`);
  root.className = "job";
  root.hidden = true;
  root.append(bar, make("div", { class: "line" }, words, make("span", { class: "buttons" }, pause, go)));
  strips.set(step, { root, bar, words, pause, go });
}

function jobText(job) {
  const name = kJobWords[job.step];
  switch (job.status) {
    case "waiting": return `${name} waits for its turn.`;
    case "stopping": return `${name} stops after this step …`;
    case "paused": return `${name} is paused. ${job.message || job.words || ""}`;
    case "done": return job.message || `${name}: done.`;
    case "failed": return `${name} failed: ${job.message}`;
    case "interrupted": return `${name} was interrupted. ${job.message || ""}`;
    default: return job.words || `${name} starts …`;
  }
}

function showStrip(strip, job) {
  const active = kActive.has(job.status), paused = job.status === "paused", share = job.status === "done" ? 1 : job.share;
  const known = typeof share === "number";
  strip.root.dataset.status = job.status;
  strip.bar.classList.toggle("unknown", active && !known);
  if (known) setAttribute(strip.bar, "aria-valuenow", Math.round(100 * share));
  else strip.bar.removeAttribute("aria-valuenow");
  strip.bar.firstElementChild.style.width = known ? `${100 * share}%` : "";
  setText(strip.words, jobText(job).trim());
  // The focus stays with the button's successor.
  const held = document.activeElement === strip.pause || document.activeElement === strip.go;
  setHidden(strip.pause, job.status !== "running" || job.step === "view" || job.step === "export");
  setHidden(strip.go, !paused && !(job.status === "interrupted" && job.step === "design"));
  if (held && document.activeElement === document.body) (strip.pause.hidden ? strip.go : strip.pause).focus();
}

let heardJob = null;
function showJob(state) {
  const job = state.job;
  for (const [step, strip] of strips) {
    const mine = job && kStepOfJob[job.step] === step;
    setHidden(strip.root, !mine);
    if (mine) showStrip(strip, job);
  }
  const busy = Boolean(job && kActive.has(job.status)), ready = Boolean(state.picture && state.picture.ready), bad = !state.light || Boolean(state.light.error);
  const can = { plan: ready, design: ready && !bad, "cam-front": Boolean(state.lens), cam: Boolean(state.lens), export: Boolean(state.lens), check: Boolean(state.lens) && state.photo };
  for (const button of document.querySelectorAll("[data-run]")) button.disabled = busy || !can[button.dataset.run];
  find("view").disabled = busy;
  find("photo").disabled = busy || !state.lens;
  const heard = job && `${state.name} ${job.step} ${job.status}`;
  if (heardJob !== heard && heardJob !== null && job) say(job.status === "running" ? `${kJobWords[job.step]} runs.` : jobText(job));
  heardJob = heard || "";
  openFinishedView(state, busy);
}

// A tab must be opened by the click itself; browsers block one that comes later.
let viewTab = null;
async function openView() {
  viewTab = window.open("", "_blank");
  if (viewTab) viewTab.document.body.textContent = "The view is being made …";
  if (!await act(3, "run", { step: "view" }) && viewTab) {
    viewTab.close();
    viewTab = null;
  }
}
function openFinishedView(state, busy) {
  if (!viewTab || busy || !state.job || state.job.step !== "view") return;
  if (state.job.status === "done" && state.lens && state.lens.view) viewTab.location = state.lens.view;
  else viewTab.close();
  viewTab = null;
}

// ---- Steps ----
function stepNotes(state) {
  const { picture, light, lens, front, part, cut } = state, minutes = [front, part].filter(Boolean).map((one) => one.minutes);
  return [picture && picture.ready ? `${picture.width} × ${picture.height}` : "", light && !light.error ? `${number(light.lens_mm[0])} mm at ${number(light.focal_mm)} mm` : "",
    lens ? `MAE ${number(lens.mae, 2)}` : "", minutes.length ? minutesText(minutes.reduce((sum, one) => sum + one)) : "", cut ? (cut.status === "running" ? `${Math.floor(cut.percent)} %` : cut.status) : ""];
}

function markCurrent(link, current) {
  if (current) link.setAttribute("aria-current", "step");
  else link.removeAttribute("aria-current");
}

function makeSteps() {
  kStepNames.forEach((words, i) => {
    const go = (e) => {
      e.preventDefault();
      const title = document.getElementById(`step-${i + 1}-title`);
      title.focus({ preventScroll: true });
      title.scrollIntoView({ block: "start" });
    };
    find("steps").append(make("li", {}, make("a", { href: `#step-${i + 1}`, onclick: go }, make("b", { text: `${i + 1}` }), make("span", { class: "word", text: words }), make("small"))));
  });
  const links = find("steps").querySelectorAll("a");
  const watch = new IntersectionObserver((entries) => {
    for (const entry of entries) if (entry.isIntersecting) links.forEach((link, i) => markCurrent(link, entry.target.id === `step-${i + 1}`));
  }, { rootMargin: "-30% 0px -65% 0px" });
  for (const section of document.querySelectorAll(".step")) watch.observe(section);
}

function showSteps(state) {
  const notes = stepNotes(state);
  find("steps").querySelectorAll("a").forEach((link, i) => {
    setText(link.lastElementChild, notes[i]);
    link.classList.toggle("reached", Boolean(notes[i]));
  });
}

// ---- The state ----
function render(state) {
  setText(find("name"), state.name);
  showFields(state);
  showPictureStep(state);
  showLightError(state);
  const url = state.picture && state.picture.url;
  showScene(state.light, url);
  if (state.light) showBlur(state.light, url);
  showPlan(state);
  showJob(state);
  showLens(state);
  showPart(state);
  showCheck(state);
  showMachineStep(state);
  showCommands(state.commands);
  showSteps(state);
}

function showTitle(state) {
  const job = state && state.job, cut = state && state.cut;
  const share = cut && cut.status === "running" ? cut.percent / 100 : job && kActive.has(job.status) ? job.share : null;
  const parts = [typeof share === "number" ? `${Math.floor(100 * share)} %` : null, state && state.name, "lensforge studio"];
  const title = parts.filter(Boolean).join(" · ");
  if (document.title !== title) document.title = title;
}

// Answers that a later one has overtaken are dropped: every POST's answer begins a new epoch.
let epoch = 0;
function take(state) {
  ++epoch;
  show(state);
}
function show(state) {
  const same = page.state && page.state.name === state.name && page.state.number === state.number;
  page.state = state;
  if (!same) render(state);
  showTitle(state);
  clearTimeout(timer);
  timer = setTimeout(tick, isBusy() ? kQuick : kSlow);
}

function isBusy() {
  const state = page.state;
  return Boolean(state && ((state.job && kActive.has(state.job.status)) || (state.cut && state.cut.status === "running")));
}

let timer = null;
let listed = 0;
async function tick() {
  clearTimeout(timer);
  const before = epoch, project = page.project;
  try {
    if (Date.now() - listed >= kSlow - 100) await list();
    if (project) {
      const state = await ask(projectPath("state.json"));
      if (before === epoch && project === page.project) show(state);
    }
  } catch (e) {
    // A project whose folder is gone; a server that is gone is asked again.
    if (e.status === 404 && project === page.project) location.hash = "";
  }
  clearTimeout(timer);
  timer = setTimeout(tick, isBusy() ? kQuick : kSlow);
}

// ---- Projects ----
function projectRow(project) {
  const current = project.name === page.project;
  const picture = project.picture ? make("img", { src: project.picture, alt: "", loading: "lazy" }) : make("span", { class: "nothing" });
  return make("li", {}, make("a", { href: `#${encodeURIComponent(project.name)}`, "data-key": project.name, "aria-current": current ? "page" : null },
    picture, make("span", {}, make("b", { text: project.name }), make("small", { text: (project.running ? "runs · " : "") + project.words }))));
}

async function list() {
  const studio = await ask("/studio.json");
  listed = Date.now();
  page.folder = studio.folder;
  const folder = find("folder");
  if (folder) setText(folder, `${studio.folder} · ${studio.program}`);
  rebuild(find("projects"), [studio.projects, page.project], ([projects]) => projects.map(projectRow));
  return studio;
}

function startProject(focus) {
  if (page.project) forgetTyped();
  Object.assign(page, { project: null, state: null });
  ++epoch;
  if (location.hash.length > 1) history.pushState(null, "", location.pathname);
  setHidden(find("project"), true);
  setHidden(find("start"), false);
  showTitle(null);
  tickSoon();
  if (focus) find("start").querySelector("h2").focus();
}

function tickSoon() {
  listed = 0;
  clearTimeout(timer);
  timer = setTimeout(tick, 0);
}

async function openProject(name) {
  if (page.project === name) return;
  if (page.project) forgetTyped();
  Object.assign(page, { project: name, state: null });
  ++epoch;
  heardJob = null;
  machine.status = null;
  for (const step of [0, 1, 2, 3, 4, 5, "project"]) showError(step, "");
  if (decodeURIComponent(location.hash.slice(1)) !== name) history.pushState(null, "", `#${encodeURIComponent(name)}`);
  setHidden(find("start"), true);
  setHidden(find("project"), false);
  listed = 0;
  await tick();
}

async function removeProject() {
  const name = page.project;
  const sure = await confirmed({ title: `Remove ${name}?`, words: `Its folder moves to ${page.folder}/.removed.`, yes: "Remove",
    more: "Nothing is deleted: move the folder back and it is a project again, or delete it to free the disk." });
  if (!sure) return;
  try {
    await post(`/projects/${encodeURIComponent(name)}/remove`);
  } catch (e) {
    return showError("project", e instanceof Refusal ? e.message : "The studio did not answer; nothing was changed.");
  }
  say(`${name} is removed.`);
  if (page.project === name) startProject(true);
}

const hashName = () => {
  try {
    return decodeURIComponent(location.hash.slice(1));
  } catch (e) {
    return "";
  }
};

function followHash() {
  const name = hashName();
  if (name) openProject(name);
  else startProject();
}

// ---- Start ----
function listenToButtons() {
  for (const button of document.querySelectorAll("[data-run]")) {
    button.addEventListener("click", () => {
      const step = button.dataset.run, format = step === "export" ? { format: find("format").value } : {};
      act(kStepOfJob[step], "run", { step, ...format });
    });
  }
  find("view").addEventListener("click", openView);
  find("photo").addEventListener("change", checkPhoto);
  find("remove").addEventListener("click", removeProject);
  find("undo").addEventListener("click", () => act(3, "undo"));
  find("redo").addEventListener("click", () => act(3, "redo"));
  window.addEventListener("hashchange", followHash);
  window.addEventListener("popstate", followHash);
}

async function begin() {
  page.forms = await ask("/forms.json");
  if (!fields.size) makeForms(page.forms);
  const studio = await list();
  if (!hashName() && studio.projects.length) await openProject(studio.projects[0].name);
  else followHash();
}

makeEditor();
makeStart();
makeParts();
makeMachine();
makeSteps();
listenToScene();
listenToButtons();
for (const step of [2, 3, 4]) makeStrip(step);
(async function beginAgain() {
  // Without the forms there is nothing to show; the server may only just be starting.
  try {
    await begin();
  } catch (e) {
    setTimeout(beginAgain, kSlow);
  }
})();
