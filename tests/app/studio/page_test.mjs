// SPDX-License-Identifier: GPL-3.0-or-later
// Drives the page of lensforge studio in a browser, from a picture to a program on a simulated machine:
// by mouse and keyboard, at three sizes of window, with axe-core's rules for accessibility.
//
//   node page_test.mjs ADDRESS [FOLDER FOR SCREENSHOTS]
//
// Needs puppeteer-core and axe-core; CHROMIUM names the browser. Exit code 1 if anything failed.
import fs from "node:fs";
import { createRequire } from "node:module";
import puppeteer from "puppeteer-core";

const [address, shots] = process.argv.slice(2);
const axeSource = fs.readFileSync(createRequire(import.meta.url).resolve("axe-core/axe.min.js"), "utf8");
const kLong = 600_000; // ms for a design, a cut
const kShort = 15_000;
// A lens that is designed and cut within seconds.
const kSmall = { "f-width": "12", "f-focal": "100", "f-pixels": "32" };
const kViews = { wide: [1400, 1000, 1], phone: [390, 844, 2], zoomed: [700, 500, 2] };

let failed = 0;
function check(what, good, more = "") {
  console.log(`${good ? "ok  " : "FAIL"}  ${what}${good ? "" : `  ${more}`}`);
  if (!good) ++failed;
}

const browser = await puppeteer.launch({ executablePath: process.env.CHROMIUM || "/usr/bin/chromium", args: ["--no-sandbox"], protocolTimeout: 2 * kLong });
const tab = await browser.newPage();
const complaints = [];
tab.on("pageerror", (e) => complaints.push(e.message));
tab.on("console", (m) => { if (m.type() === "error" && !/status of 40[04]/.test(m.text())) complaints.push(m.text()); });

// ---- Helpers ----
const text = (selector) => tab.$eval(selector, (node) => node.textContent.trim());
const until = (test, arg, timeout = kShort) => tab.waitForFunction(test, { timeout, polling: 100 }, arg);
const shown = (selector, timeout = kShort) => tab.waitForSelector(selector, { visible: true, timeout });
const press = (selector) => tab.$eval(selector, (node) => { node.scrollIntoView({ block: "center" }); node.click(); });
const has = (selector, words, timeout = kShort) => until(([s, w]) => document.querySelector(s) && document.querySelector(s).textContent.includes(w), [selector, words], timeout);
const pause = (ms) => new Promise((resolve) => setTimeout(resolve, ms));

async function fill(id, value) {
  const field = await shown(`#${id}`);
  await field.evaluate((node) => { node.scrollIntoView({ block: "center" }); node.focus(); node.select(); });
  await tab.keyboard.type(value);
  await tab.$eval(`#${id}`, (node) => node.dispatchEvent(new Event("change", { bubbles: true })));
}

async function jobEnds(step, timeout = kLong) {
  await until((s) => ["done", "failed", "interrupted", "paused"].includes((document.querySelector(`[data-job="${s}"]:not([hidden])`) || { dataset: {} }).dataset.status), step, timeout);
  return tab.$eval(`[data-job="${step}"]`, (node) => node.dataset.status);
}

async function look(name) {
  for (const [view, [width, height, scale]] of Object.entries(kViews)) {
    await tab.setViewport({ width, height, deviceScaleFactor: scale });
    // Where the page happens to be scrolled to, the steps' bar may hide a part of a control.
    await tab.evaluate(() => window.scrollTo(0, 0));
    await pause(250);
    const over = await tab.evaluate(() => document.documentElement.scrollWidth - document.documentElement.clientWidth);
    check(`${name}, ${view}: no horizontal scroll`, over <= 0, `${over} px`);
    if (!(await tab.evaluate(() => Boolean(window.axe)))) await tab.evaluate(axeSource);
    const found = await tab.evaluate(() => axe.run(document, { runOnly: ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa", "best-practice"] }));
    check(`${name}, ${view}: axe-core finds nothing`, found.violations.length === 0, found.violations.map((v) => `${v.id}: ${v.nodes.slice(0, 3).map((n) => `${n.target} ${n.failureSummary.split("\n")[1] || ""}`).join(" | ")}`).join("\n      "));
    if (shots) await tab.screenshot({ path: `${shots}/${name}-${view}.png`, fullPage: true });
  }
  await tab.setViewport({ width: kViews.wide[0], height: kViews.wide[1] });
  await pause(150);
}

// ---- A new project from a text ----
await tab.setViewport({ width: kViews.wide[0], height: kViews.wide[1] });
await tab.goto(address);
await shown("[data-new]");
await pause(600);
await press("[data-new]");
await shown("#letters-text");
await fill("letters-text", "lux");
await look("new");
await press("[data-letters] button[type=submit]");
await shown("[data-project]");
await until(() => location.hash.length > 1);
await until(() => document.querySelector("[data-crop]").width > 100 && document.getElementById("crop-width").value > 0);
const project = await tab.evaluate(() => decodeURIComponent(location.hash.slice(1)));
check("a text becomes a project", project.length > 0);

// ---- Picture ----
await tab.select("[data-aspect]", "1");
await fill("crop-width", "120");
await tab.keyboard.press("Tab");
await until(() => document.getElementById("crop-height").value === "120");
check("the aspect is kept", true);
const box = await (await tab.$("[data-crop]")).boundingBox();
await tab.$eval("[data-crop]", (node) => node.scrollIntoView({ block: "center" }));
const at = await (await tab.$("[data-crop]")).boundingBox();
const scale = await tab.evaluate((width) => width / Number(document.querySelector("[data-crop]").getAttribute("width")), box.width);
await tab.mouse.move(at.x + 40 * scale, at.y + 40 * scale);
await tab.mouse.down();
await tab.mouse.move(at.x + 70 * scale, at.y + 40 * scale, { steps: 4 });
await tab.mouse.up();
check("dragging moves the crop", Number(await tab.$eval("#crop-x", (n) => n.value)) > 0);
await tab.$eval("#tone-gamma", (node) => { node.focus(); });
await tab.keyboard.press("ArrowRight");
await press("[data-use]");
await has("[data-picture-size]", "120 × 120");
check("the cropped picture is in use", true);

// ---- Light and size ----
for (const [id, value] of Object.entries(kSmall)) await fill(id, value);
await fill("f-lamp", "led:1mm@600mm");
await has("[data-scene-words]", "12 × 12 mm");
await has("[data-scene-words]", "600 mm before the lens");
check("the scene follows the settings", true);
await fill("f-width", "-5");
await shown("#f-width-error");
check("a refusal is shown at its field", (await text("#f-width-error")).length > 5 && await tab.$eval("#f-width", (n) => n.value === "-5" && n.getAttribute("aria-invalid") === "true"));
await fill("f-width", "1.2 cm");
await until(() => document.getElementById("f-width-error").hidden);
await tab.$eval("#f-focal", (node) => node.focus());
await until(() => document.getElementById("f-width").value === "12");
check("lengths accept units", true);
const deviation = () => tab.$eval("[data-blur] feGaussianBlur", (node) => Number(node.getAttribute("stdDeviation")));
const blurred = await deviation();
for (const cause of await tab.$$("[data-causes] input")) await cause.evaluate((node) => node.click());
check("blur is shown by cause", blurred > 0 && (await deviation()) === 0, `${blurred}, ${await deviation()}`);
for (const cause of await tab.$$("[data-causes] input")) await cause.evaluate((node) => node.click());
await press("#step-2 details.more > summary");
await tab.$eval("#f-lamp", (node) => node.closest(".field").querySelector(".back").click());
await tab.select("#f-mode", "reflect");
await fill("f-incidence", "40");
await has("[data-scene-words]", "a mirror of 12 × 12 mm");
check("the scene shows a mirror", (await tab.$$eval("[data-scene] .mirror", (all) => all.length)) === 6 && (await text("[data-scene] svg")).includes("mirror 12 × 12 mm"));
await tab.select("#f-mode", "refract");
await fill("f-incidence", "0");
await fill("f-lamp", "led:1mm@600mm");
await has("[data-scene-words]", "a lens of 12 × 12 mm");
const place = () => tab.$eval("[data-scene] image", (node) => node.getAttribute("transform"));
const before = await place();
await tab.focus("[data-scene]");
await tab.keyboard.press("ArrowLeft");
await tab.keyboard.press("ArrowUp");
const turned = await place();
await tab.keyboard.press("Home");
check("arrow keys turn the scene, Home turns it back", turned !== before && (await place()) === before);
await press('[data-run="plan"]');
check("the plan is done", (await jobEnds(2)) === "done");
await shown("[data-proposals] .card");
await look("plan");
await press("[data-proposals] .card button");
await shown("[data-proposals] .card.taken");
for (const [id, value] of Object.entries(kSmall)) await fill(id, value);
await has("[data-scene-words]", "12 × 12 mm");

// ---- Lens ----
const design = async (stops) => {
  await press('[data-run="design"]');
  await until(() => { const strip = document.querySelector('[data-job="3"]'); return !strip.hidden && strip.dataset.status === "running"; });
  if (stops) {
    const seen = await shown("[data-live]", 20_000).catch(() => null);
    if (seen) await look("design");
    // A small lens may be done before one can pause.
    const canPause = await tab.$eval('[data-job="3"] button', (node) => { if (node.hidden) return false; node.click(); return true; });
    if (canPause) {
      const status = await jobEnds(3);
      check("the design pauses", ["paused", "done"].includes(status), status);
      if (status === "paused") await press('[data-job="3"] button:not([hidden])');
      await until(() => !["paused"].includes(document.querySelector('[data-job="3"]').dataset.status));
    }
  }
  return jobEnds(3);
};
check("the design is done", (await design(true)) === "done", await text('[data-job="3"]'));
await shown("[data-lens-pictures] img");
await until(() => [...document.querySelectorAll("[data-lens-pictures] img")].every((image) => image.complete && image.naturalWidth > 0));
check("the lens has its pictures", true);
await tab.$eval("#f-lamp", (node) => node.closest(".field").querySelector(".back").click());
await fill("f-focal", "110");
await has("[data-scene-words]", "110 mm away");
check("a second version is designed", (await design(false)) === "done");
await until(() => !document.querySelector("[data-undo]").disabled);
const version = await text("[data-version]");
await press("[data-undo]");
await until((old) => document.querySelector("[data-version]").textContent !== old, version);
await until(() => !document.querySelector("[data-redo]").disabled);
await press("[data-redo]");
await until((old) => document.querySelector("[data-version]").textContent === old, version);
check("undo and redo change the version", true);
const opened = new Promise((resolve) => browser.once("targetcreated", resolve));
await press("[data-view]");
const target = await opened;
// The page is in the background now: browsers draw nothing there, and puppeteer waits for drawings.
await browser.waitForTarget((t) => t === target && t.url().startsWith("http"), { timeout: kLong });
check("the view opens in a new tab", true, target.url());
await (await target.page()).close();
await tab.bringToFront();
await shown("[data-view-link]");

// ---- Part ----
await tab.$$eval("#step-4 details.group", (all) => all.forEach((node) => { node.open = node.dataset.group === "finish"; }));
await fill("f-finish-pitch", "0.2");
await until(() => document.querySelector("#f-finish-pitch").closest(".field").classList.contains("changed"));
check("a changed value of the workshop is marked", true);
await press("#step-4 .field.changed .back");
await until(() => !document.querySelector("#f-finish-pitch").closest(".field").classList.contains("changed"));
check("reset brings the default back", (await tab.$eval("#f-finish-pitch", (n) => n.value)) !== "0.2");
await fill("f-finish-pitch", "0.1");
await until(() => document.querySelector("#f-finish-pitch").closest(".field").classList.contains("changed"));
await press('[data-run="cam"]');
await pause(500);
check("the part is cut", (await jobEnds(4)) === "done", await text('[data-job="4"]'));
await shown('[data-part="part"] [data-figures] b');
const figures = '[data-part="part"] [data-figures]';
check("the verdict has the MAE and its range", /\d/.test(await text(`${figures} b`)) && (await text(figures)).includes("P10–P90"), await text(figures));
await tab.select("[data-format]", "stl");
await press('[data-run="export"]');
await pause(300);
check("the lens is exported", (await jobEnds(4)) === "done", await text('[data-job="4"]'));

// ---- A photograph of the wall ----
await (await tab.$("[data-photo]")).uploadFile(process.argv[1]);
await has('[data-error="4"]', "no picture can be read");
check("a photograph that is none is refused", true);
const light = await tab.$eval('[data-lens-pictures] img[alt^="Light on the wall"]', async (node) => {
  const bytes = await (await fetch(node.src)).blob();
  return new Promise((resolve) => {
    const reader = new FileReader();
    reader.onload = () => resolve(reader.result);
    reader.readAsDataURL(bytes);
  });
});
const wall = await browser.newPage();
await wall.setContent(`<body style="margin:0;background:#222"><img style="margin:90px;width:300px;opacity:0.9" src="${light}">`);
const photo = `${shots || "."}/wall.png`;
await wall.screenshot({ path: photo });
await wall.close();
await tab.bringToFront();
await (await tab.$("[data-photo]")).uploadFile(photo);
await has('[data-job="4"]', "Check");
check("the photograph is checked", (await jobEnds(4)) === "done", await text('[data-job="4"]'));
await shown("[data-check]");
check("it says what is wrong, beside the pictures", (await text("[data-check-verdict]")).length > 20 && (await tab.$$("[data-check-pictures] img")).length === 3);
await look("check");

// ---- Machine ----
await until(() => document.querySelector("[data-program]").value !== "");
await fill("port", "/dev/ttyUSB7");
await press("[data-send-button]");
await shown("[data-confirm][open]");
check("a real machine asks first, and No is what Enter does", await tab.evaluate(() => document.activeElement.value === "no"));
await tab.keyboard.press("Enter");
await until(() => !document.querySelector("[data-confirm]").open);
await fill("port", "sim:grbl@1x");
await press("[data-send-button]");
await shown("[data-cut]", 30_000);
await has("[data-cut-state]", "Run", 30_000);
await shown("[data-tool]", 30_000);
await tab.keyboard.press("h");
await has("[data-cut-state]", "Hold");
check("the key h holds", true);
await tab.keyboard.press("r");
await has("[data-cut-state]", "Run");
await tab.keyboard.press("Space");
await has("[data-cut-state]", "Hold");
check("the space bar holds, on a button too", true);
await tab.keyboard.press("r");
await has("[data-cut-state]", "Run");
await tab.keyboard.type("+");
await has("[data-cut-numbers]", "110 %");
check("the key + raises the feed", true);
await pause(1500);
await look("machine");
await press('[data-keys] [data-key="Q"]');
await until(() => ["done", "interrupted", "failed"].includes(document.querySelector("[data-cut-state]").dataset.state), null, 60_000);
check("the key Q ends the job", (await tab.$eval("[data-cut-state]", (n) => n.dataset.state)) === "interrupted");

// ---- Both faces, and a second picture ----
for (const [id, value] of Object.entries({ "f-width": "6", "f-focal": "40", "f-pixels": "16" })) await fill(id, value);
await tab.select("#f-quality", "draft");
await tab.select("#f-faces", "two");
await shown("[data-plan-note]");
check("a lens of two shaped faces is designed", (await design(false)) === "done", await text('[data-job="3"]'));
check("its faces are shown", (await tab.$$('[data-lens-pictures] img[alt^="Relief of the"]')).length === 2);
await press('[data-run="cam-front"]');
await pause(500);
check("its front is cut", (await jobEnds(4)) === "done", await text('[data-job="4"]'));
await shown('[data-part="front"] [data-figures] b');
await press('[data-run="cam"]');
await pause(500);
check("its back is cut, and judged with the front as made", (await jobEnds(4)) === "done" && (await text('[data-part="part"]')).includes("Both faces as made: MAE"), await text('[data-job="4"]'));
check("the front's programs can be sent", (await text("[data-program]")).includes("front: finish.ngc"));
await look("faces");
await tab.select("#f-faces", "one");
await (await tab.$("[data-second-file]")).uploadFile(process.argv[1]);
await has('[data-error="1"]', "page_test.mjs");
check("a second picture that is none is refused", await tab.$eval("[data-which]", (node) => node.hidden));
await (await tab.$("[data-second-file]")).uploadFile(photo);
await has("#f-second-error", "needs the place of its screen");
await fill("f-second-focal", "160");
await has("#f-second-error", "same proportions");
await until(() => document.querySelector("[data-aspect]").value === "other" && !document.querySelector("[data-use]").disabled);
await press("[data-use]");
await until(() => document.getElementById("f-second-error").hidden);
check("it is cropped to the first one's proportions", true);
await look("second");
const own = `${shots || "."}/second.png`;
fs.writeFileSync(own, Buffer.from(light.split(",")[1], "base64"));
await (await tab.$("[data-second-file]")).uploadFile(own);
await fill("f-thickness", "6");
await has("[data-scene-words]", "on a wall 160 mm away");
check("the scene shows both walls", (await tab.$$("[data-scene] .wall.second")).length === 1);
check("a lens for two pictures is designed", (await design(false)) === "done", await text('[data-job="3"]'));
check("both screens are shown", (await tab.$$('[data-lens-pictures] img[alt="Light on the second wall"]')).length === 1);

// ---- Commands, reload, keyboard ----
for (const name of ["plan", "design view", "cam-front cam export check", "send"]) check(`commands: ${name}`, (await text(`[data-commands="${name}"]`)).includes("lensforge "));
await tab.reload();
await until((name) => document.querySelector("[data-name]").textContent === name, project);
check("a reload comes back to the project", true);
await pause(800);
const reached = new Set();
let hiddenFocus = 0;
await tab.evaluate(() => { window.scrollTo(0, 0); document.activeElement.blur(); });
for (let i = 0; i < 400; ++i) {
  await tab.keyboard.press("Tab");
  const stop = await tab.evaluate(() => {
    const node = document.activeElement, style = getComputedStyle(node);
    return node === document.body ? null : { id: node.id || [...node.attributes].map((a) => a.name + (a.value ? `=${a.value}` : "")).find((a) => a.startsWith("data-")) || node.textContent.slice(0, 20),
      visible: style.outlineStyle !== "none" && parseFloat(style.outlineWidth) >= 2 || node.classList.contains("unseen") };
  });
  if (!stop) break;
  reached.add(stop.id);
  if (!stop.visible && hiddenFocus++ < 5) console.log("      no visible focus:", stop.id);
}
for (const id of ["data-new", "crop-width", "tone-gamma", "data-original", "f-lamp", "data-scene", "data-run=plan", "data-run=design", "data-view", "data-run=cam", "format", "data-run=export", "photo", "second", "program", "port"]) check(`Tab reaches ${id}`, reached.has(id));
check("every stop of Tab has a visible focus", hiddenFocus === 0, `${hiddenFocus} have none`);

// ---- Removing ----
await press("[data-remove]");
await shown("[data-confirm][open]");
check("the dialog names the project and where it goes", (await text("[data-confirm]")).includes(project) && (await text("[data-confirm]")).includes("/.removed"), await text("[data-confirm]"));
await look("remove");
await tab.keyboard.press("Enter");
await until(() => !document.querySelector("[data-confirm]").open);
check("not yet keeps it", (await text("[data-name]")) === project);
await press("[data-remove]");
await shown("[data-confirm][open]");
await press("[data-confirm-yes]");
await shown("[data-start]");
await until((name) => ![...document.querySelectorAll("[data-projects] b")].some((b) => b.textContent === name), project);
check("a removed project leaves the list", true);
check("the browser has no complaints", complaints.length === 0, complaints.join("\n      "));
await browser.close();
console.log(failed ? `${failed} checks failed` : "all checks passed");
process.exit(failed ? 1 : 0);
