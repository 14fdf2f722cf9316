// SPDX-License-Identifier: GPL-3.0-or-later
// What all parts of the page use: elements, numbers as text, and the server.

const find = (name) => document.querySelector(`[data-${name}]`);
// The project that is shown, the server's last word on it, and the forms that it offers.
const page = { project: null, state: null, forms: null, folder: "" };

// ---- Elements ----
function make(tag, properties = {}, ...children) {
  const node = document.createElement(tag);
  for (const [name, value] of Object.entries(properties)) {
    if (value === null || value === undefined || value === false) continue;
    if (name.startsWith("on")) node.addEventListener(name.slice(2), value);
    else if (name === "text") node.textContent = value;
    else node.setAttribute(name, value === true ? "" : value);
  }
  node.append(...children.filter((child) => child !== null));
  return node;
}

// Touches the document only where something differs, so that nothing flickers or loses the focus.
function setText(node, text) {
  if (node.textContent !== text) node.textContent = text;
}
function setHidden(node, hidden) {
  if (node.hidden !== hidden) node.hidden = hidden;
}
function setAttribute(node, name, value) {
  if (node.getAttribute(name) !== String(value)) node.setAttribute(name, value);
}

// Shows a new picture only once it is there: the old one stays until then.
const wanted = new WeakMap();
function setPicture(image, url) {
  if (wanted.get(image) === url) return;
  wanted.set(image, url);
  if (!url) {
    image.removeAttribute("src");
    return;
  }
  const next = new Image();
  next.onload = () => { if (wanted.get(image) === url) image.src = url; };
  // A picture that was replaced on the way is asked for again with the next state.
  next.onerror = () => { if (wanted.get(image) === url) wanted.delete(image); };
  next.src = url;
}

// Rebuilds a container if its data changed; the focus stays on the element with the same data-key.
const built = new WeakMap();
function rebuild(container, data, build) {
  const mark = JSON.stringify(data);
  if (built.get(container) === mark) return;
  built.set(container, mark);
  const held = container.contains(document.activeElement) ? document.activeElement.dataset.key : null;
  container.replaceChildren(...build(data));
  if (held) container.querySelector(`[data-key="${CSS.escape(held)}"]`)?.focus();
}

// Screen readers hear what changed, not every half second of it.
function say(text) {
  setText(find("said"), text);
}

function showError(step, message) {
  const line = document.querySelector(`[data-error="${step}"]`);
  setText(line, message || "");
  setHidden(line, !message);
}

// Asks in a dialog; true if it is answered with `yes`, the words of its button.
function confirmed({ title, words, more, yes }) {
  const dialog = find("confirm");
  for (const [name, text] of Object.entries({ title, words, more, yes })) setText(find(`confirm-${name}`), text);
  return new Promise((resolve) => {
    dialog.addEventListener("close", () => resolve(dialog.returnValue === "yes"), { once: true });
    dialog.returnValue = "no";
    dialog.showModal();
  });
}

// ---- Numbers as text ----
const number = (value, digits = 4) => String(Number(Number(value).toPrecision(digits))).replace("-", "−");
const millimetres = (value) => `${number(value)} mm`;
const sizeText = (size) => `${number(size[0])} × ${number(size[1])} mm`;
const percent = (share) => `${number(100 * share, 3)} %`;

function minutesText(minutes) {
  if (minutes < 1) return `${Math.round(60 * minutes)} s`;
  const whole = Math.round(minutes), hours = Math.floor(whole / 60);
  return hours ? `${hours} h ${whole % 60} min` : `${whole} min`;
}

function bytesText(bytes) {
  const units = ["bytes", "kB", "MB", "GB"];
  let unit = 0;
  for (; bytes >= 1000 && unit < 3; ++unit) bytes /= 1000;
  return `${number(bytes, 3)} ${units[unit]}`;
}

// ---- The server ----
// A refusal has the server's sentence; any other failure means that nobody answered.
class Refusal extends Error {}

function showGone(gone) {
  setText(find("gone"), gone ? "lensforge studio has ended; start it again and reload. Nothing is lost." : "");
  setHidden(find("gone"), !gone);
}

async function answerOf(path, options) {
  let answer = null;
  try {
    answer = await fetch(path, { cache: "no-store", ...options });
  } catch (e) {
    showGone(true);
    throw e;
  }
  showGone(false);
  const content = await answer.json().catch(() => ({}));
  if (answer.ok) return content;
  const refusal = new Refusal(content.error || `The studio answered ${answer.status}.`);
  refusal.status = answer.status;
  throw refusal;
}

const ask = (path) => answerOf(path, {});
function post(path, body) {
  const raw = body instanceof Blob || body === undefined;
  return answerOf(path, { method: "POST", body: raw ? body : JSON.stringify(body), headers: { "X-Lensforge": "studio" } });
}
const projectPath = (rest) => `/projects/${encodeURIComponent(page.project)}/${rest}`;

// Does what a button asks; the answer is the project's new state.
async function act(step, path, body) {
  const project = page.project;
  showError(step, "");
  try {
    const state = await post(projectPath(path), body);
    if (project === page.project) take(state);
    return true;
  } catch (e) {
    if (project === page.project) showError(step, e instanceof Refusal ? e.message : "The studio did not answer; nothing was changed.");
    return false;
  }
}
