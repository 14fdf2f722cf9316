// SPDX-License-Identifier: GPL-3.0-or-later
// Settings of light and size, and of the workshop: fields as the server describes them.

// What a person asks first, in this order, in plain words.
const kFirstFields = [
  ["--lamp", "Lamp", "Sun, an LED with its diameter and distance, torch, projector or laser. Empty is parallel light."],
  ["--material", "Material", "What the lens is made of."],
  ["--width", "Lens width", "The height follows the picture."],
  ["--focal", "Distance of the wall", "From the lens’s flat face."],
  ["--image-width", "Picture width on the wall", "0 takes the lens’s width."],
  ["--pixels", "Pixels, longer side", "More show finer detail and take longer."],
];
// Those of a second picture, which stand beside it.
const kSecondFields = [
  ["--second", "Design with the second picture", "The same light makes it on a wall farther away, or nearer."],
  ["--second-focal", "Distance of the second wall", "From the lens’s front; at least 1.5 times the nearer wall’s."],
  ["--second-width", "Width of the second picture", "0 takes the first one’s."],
  ["--second-offset", "Offset of the second picture", "As X,Y in mm."],
  ["--second-tilt", "Tilt of the second wall", "As AX,AY in degrees."],
];
const kDebounce = 300; // ms
const kUnits = { "": 1, mm: 1, cm: 10, m: 1000, um: 1e-3, "µm": 1e-3, in: 25.4 };

// All fields by name, and what was typed and not yet sent, by form.
const fields = new Map();
const unsent = { settings: {}, workshop: {} };
let sendTimer = null;

// ---- One field ----
// "--source-angle" is "Source angle"; "tool.1.diameter" is "Diameter" in the section "tool.1".
function plainLabel(name, section = "") {
  const own = section && name.startsWith(`${section}.`) ? name.slice(section.length + 1) : name;
  const words = own.replace(/^--/, "").replace(/[-_.]/g, " ");
  return words[0].toUpperCase() + words.slice(1);
}

function fieldInput(field, id) {
  if (field.kind === "flag") return make("input", { id, type: "checkbox" });
  if (field.kind === "word") return make("select", { id }, ...field.words.map((word) => make("option", { value: word, text: word || "none" })));
  const counts = ["whole", "number", "length"].includes(field.kind);
  const list = (field.suggestions || []).length ? `${id}-list` : null;
  return make("input", { id, type: "text", list, inputmode: counts ? "decimal" : null, autocomplete: "off", spellcheck: "false" });
}

function hintOf(field, plainHint) {
  const own = plainHint || field.help || "";
  // The unit stands in the field.
  const hint = field.unit && own.startsWith(field.unit) ? own.slice(field.unit.length).replace(/^[\s,;:]+/, "") : own, capital = hint && hint[0].toUpperCase() + hint.slice(1).replace(/\.$/, "");
  return [capital, field.rule].filter(Boolean).join("; ").replace(/[^.]$/, "$&.");
}

// @param form  "settings" or "workshop". @param plain  a row of kFirstFields.
function makeField(field, form, plain, section) {
  const id = `f-${field.name.replace(/^--/, "").replace(/[^a-z0-9]+/gi, "-")}`, input = fieldInput(field, id);
  const error = make("p", { class: "error", id: `${id}-error`, hidden: true });
  const hint = make("p", { class: "hint", id: `${id}-hint`, text: hintOf(field, plain && plain[2]) });
  const words = plain ? plain[1] : plainLabel(field.name, section);
  const back = make("button", { type: "button", class: "back", text: "reset", "aria-label": `Reset ${words.toLowerCase()}`, hidden: true, onclick: () => resetField(field.name) });
  const list = input.getAttribute("list") ? make("datalist", { id: input.getAttribute("list") }, ...field.suggestions.map((value) => make("option", { value }))) : null;
  input.setAttribute("aria-describedby", `${hint.id} ${error.id}`);
  input.addEventListener(input.tagName === "INPUT" && input.type === "text" ? "input" : "change", () => fieldTyped(field.name));
  // A value as the server has it, once one has left the field: "1.2 cm" is 12.
  input.addEventListener("blur", () => { if (page.state) showFields(page.state); });
  const label = make("label", { for: id, text: words });
  const flag = field.kind === "flag";
  const box = make("span", { class: "box" }, input, field.unit && !flag ? make("span", { class: "unit", text: field.unit }) : null);
  const row = make("div", { class: flag ? "field flag" : "field" }, ...(flag ? [box, label] : [label, box]), back, list, hint, error);
  fields.set(field.name, { field, form, input, row, back, error, typed: null });
  return row;
}

const isNumber = (field) => ["whole", "number", "length"].includes(field.kind);

function shownValue(field, value) {
  if (value === null || value === undefined) return "";
  return isNumber(field) && typeof value === "number" ? String(Number(value.toPrecision(12))) : String(value);
}

// What a field says: its value, null for the default, or a sentence about what is wrong with it.
function readField({ field, input }) {
  if (field.kind === "flag") return { value: input.checked === field.value ? null : input.checked };
  const text = input.value.trim();
  if (text === "" || text === shownValue(field, field.value)) return { value: null };
  if (!isNumber(field)) return { value: text };
  const parts = /^([-+]?[\d.,]+(?:e[-+]?\d+)?)\s*(\D*)$/i.exec(text), unit = parts && parts[2].trim();
  const value = parts ? Number(parts[1].replace(",", ".")) * (field.kind === "length" ? kUnits[unit] : unit && unit !== field.unit ? NaN : 1) : NaN;
  return Number.isFinite(value) ? { value } : { wrong: `“${text}” is no ${field.kind === "length" ? "length, such as 60, 6 cm or 2.5 in" : "number"}.` };
}

function setFieldError(entry, message) {
  setText(entry.error, message || "");
  setHidden(entry.error, !message);
  if (message) entry.input.setAttribute("aria-invalid", "true");
  else entry.input.removeAttribute("aria-invalid");
}

// ---- Sending what was typed ----
function fieldTyped(name) {
  const entry = fields.get(name), { value, wrong } = readField(entry);
  entry.typed = true;
  setFieldError(entry, wrong);
  if (wrong) return;
  unsent[entry.form][name] = value;
  clearTimeout(sendTimer);
  sendTimer = setTimeout(sendFields, kDebounce);
}

function resetField(name) {
  const entry = fields.get(name);
  entry.typed = null;
  setFieldError(entry, "");
  if (entry.field.kind === "flag") entry.input.checked = entry.field.value;
  else entry.input.value = shownValue(entry.field, entry.field.value);
  unsent[entry.form][name] = null;
  entry.input.focus();
  clearTimeout(sendTimer);
  sendFields();
}

const stepOfForm = (form) => (form === "workshop" ? 4 : 2);

// A refusal is shown at the field whose name it begins with, else at the step.
function showRefusal(message, step) {
  const name = [...fields.keys()].filter((key) => message.startsWith(key)).sort((a, b) => b.length - a.length)[0];
  if (!name) showError(step, message);
  else setFieldError(fields.get(name), message.slice(name.length).replace(/^[\s:]+/, ""));
  return name;
}

async function sendFields() {
  const sent = { settings: unsent.settings, workshop: unsent.workshop }, project = page.project;
  const names = [...Object.keys(sent.settings), ...Object.keys(sent.workshop)];
  if (!names.length) return;
  Object.assign(unsent, { settings: {}, workshop: {} });
  const step = stepOfForm(Object.keys(sent.settings).length ? "settings" : "workshop");
  showError(step, "");
  try {
    const state = await post(projectPath("settings"), sent);
    for (const name of names) settle(name);
    if (project !== page.project) return;
    take(state);
    showFields(state);
  } catch (e) {
    if (project === page.project) await refused(e, sent, step);
  }
}

function settle(name) {
  const entry = fields.get(name);
  if (name in unsent[entry.form]) return;
  entry.typed = null;
  setFieldError(entry, "");
}

// The others go again without the one that was refused, which keeps what was typed.
async function refused(e, sent, step) {
  if (!(e instanceof Refusal)) {
    for (const form of ["settings", "workshop"]) unsent[form] = { ...sent[form], ...unsent[form] };
    sendTimer = setTimeout(sendFields, 2000);
    return;
  }
  const name = showRefusal(e.message, step);
  if (!name || !(name in sent.settings || name in sent.workshop)) return;
  for (const form of ["settings", "workshop"]) {
    delete sent[form][name];
    unsent[form] = { ...sent[form], ...unsent[form] };
  }
  await sendFields();
}

// A new project begins with nothing typed.
function forgetTyped() {
  clearTimeout(sendTimer);
  sendFields();
  for (const entry of fields.values()) {
    entry.typed = null;
    setFieldError(entry, "");
  }
}

// ---- The forms ----
function showFields(state) {
  for (const [name, entry] of fields) {
    const own = state[entry.form] || {}, changed = Object.hasOwn(own, name), value = changed ? own[name] : entry.field.value;
    entry.row.classList.toggle("changed", changed);
    setHidden(entry.back, !changed && !entry.typed);
    if (entry.typed || document.activeElement === entry.input && entry.input.type !== "checkbox") continue;
    if (entry.field.kind === "flag") entry.input.checked = Boolean(value);
    else if (entry.input.value !== shownValue(entry.field, value)) entry.input.value = shownValue(entry.field, value);
  }
  for (const group of document.querySelectorAll("[data-group]")) {
    const count = group.querySelectorAll(".field.changed").length;
    setText(group.querySelector("[data-count]"), count ? `${count} changed` : "");
  }
  const changes = Object.keys(state.workshop || {}).length;
  setText(find("workshop-words"), changes ? `${changes === 1 ? "One value differs" : `${changes} values differ`} from the default.` : "All values are the default’s.");
}

// The sentence that the server has about the light as a whole.
let lightError = null;
function showLightError(state) {
  const message = (state.light && state.light.error) || null;
  if (lightError && message !== lightError) {
    showError(2, "");
    for (const entry of fields.values()) if (entry.form === "settings" && !entry.typed) setFieldError(entry, "");
  }
  lightError = message;
  if (message) showRefusal(message, 2);
}

function makeForms(forms) {
  const left = new Map(forms.light.map((field) => [field.name, field]));
  for (const plain of kFirstFields) {
    if (left.has(plain[0])) find("light").append(makeField(left.get(plain[0]), "settings", plain));
    left.delete(plain[0]);
  }
  for (const plain of kSecondFields) {
    if (left.has(plain[0])) find("second-fields").append(makeField(left.get(plain[0]), "settings", plain));
    left.delete(plain[0]);
  }
  const madeBy = left.get("--made-by");
  if (madeBy) find("made-by").append(makeField(madeBy, "settings", ["--made-by", "Shape the lens for this workshop", "The design counts what its tool and polish leave."]));
  left.delete("--made-by");
  find("light-more").append(...[...left.values()].map((field) => makeField(field, "settings")));
  for (const section of forms.workshop) {
    const rows = make("div", { class: "fields" }, ...section.fields.map((field) => makeField(field, "workshop", null, section.name)));
    const summary = make("summary", {}, make("b", { text: plainLabel(section.name) }), " ",
      make("span", { class: "soft", text: section.help }), " ", make("span", { class: "count", "data-count": true }));
    find("workshop").append(make("details", { class: "group", "data-group": section.name }, summary, rows));
  }
  find("light-more").closest("details").hidden = !left.size;
}
