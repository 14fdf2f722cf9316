// SPDX-License-Identifier: GPL-3.0-or-later
// Step 5: sends a program to the machine, shows the tool, and passes the operator's keys on.

// Keys of `lensforge send`, in groups: the key, its face, what it does.
const kKeyGroups = [
  ["Motion", [["h", "H", "Hold"], ["r", "R", "Resume"]]],
  ["Feed", [["-", "−", "Feed down"], ["=", "=", "Feed 100\u00a0%"], ["+", "+", "Feed up"]]],
  ["Rapids", [["3", "3", "Rapids 25\u00a0%"], ["2", "2", "Rapids 50\u00a0%"], ["1", "1", "Rapids 100\u00a0%"]]],
  ["Spindle", [["<", "<", "Spindle down"], [".", ".", "Spindle 100\u00a0%"], [">", ">", "Spindle up"]]],
  ["End", [["Q", "⇧Q", "End job"]]],
];
const kKeys = new Set(kKeyGroups.flatMap(([, keys]) => keys.map(([key]) => key)));
const kKeyNames = { h: "H Space", r: "R", Q: "Shift+Q", "+": "Plus" };
const kKeyClasses = { h: "hold", Q: "end" };
// So many places of the tool are drawn behind it.
const kTrail = 600;

const machine = { trail: [], program: null, status: null };

// ---- Sending ----
const isSimulated = (port) => port.startsWith("sim:");

// What the operator is asked, by how a program is sent: from its start, or after a job that has not ended.
const kHow = {
  "": { title: "Send to a real machine?", yes: "Send",
    more: "Is the blank clamped, the tool of this program in the spindle, and the work zero set? The spindle starts and the axes move." },
  resume: { title: "Go on where it stopped?", yes: "Go on",
    more: "Is the blank clamped as it was, and the same tool in the spindle? The machine homes, the spindle starts, and the tool goes back into the cut." },
  restart: { title: "Begin again?", yes: "Begin again",
    more: "The journal of the first try is lost. Is the blank clamped, the tool of this program in the spindle, and the work zero set? The spindle starts and the axes move." },
};

async function sendProgram(how) {
  const { program, port } = how ? page.state.cut : { program: find("program").value, port: find("port").value.trim() };
  if (!program) return showError(5, "There is no program yet: cut the part first.");
  if (!port) return showError(5, "Name the port of the controller.");
  if (!isSimulated(port) && !await confirmed({ ...kHow[how], words: `${program} goes to ${port}.` })) return;
  machine.trail = [];
  // The keys work at once.
  if (await act(5, "send", { program, port, how })) find("keys").querySelector("button").focus();
}

// ---- Keys ----
const cutRuns = () => Boolean(page.state && page.state.cut && page.state.cut.status === "running");

function pressKey(key) {
  if (cutRuns()) act(5, "key", { key });
}

// The space bar holds whatever has the focus: an operator who wants the machine to stop does not look
// where the focus is. Fields keep their keys.
function keyDown(e) {
  if (!cutRuns() || e.ctrlKey || e.metaKey || e.altKey || e.target.matches("input, select, textarea, summary")) return;
  const key = e.key === " " ? "h" : e.key;
  if (!kKeys.has(key)) return;
  e.preventDefault();
  if (e.repeat) return;
  const button = find("keys").querySelector(`[data-key="${CSS.escape(key)}"]`);
  button.classList.add("pressed");
  setTimeout(() => button.classList.remove("pressed"), 160);
  pressKey(key);
}

function makeMachine() {
  for (const [words, keys] of kKeyGroups) {
    const buttons = keys.map(([key, shown, does]) => make("button", { type: "button", "data-key": key, class: kKeyClasses[key],
      "aria-keyshortcuts": kKeyNames[key] || key, onclick: () => pressKey(key) }, make("kbd", { text: shown, "aria-hidden": "true" }), does));
    find("keys").append(make("div", { role: "group", "aria-label": words }, ...buttons));
  }
  find("send").addEventListener("submit", (e) => {
    e.preventDefault();
    sendProgram("");
  });
  for (const how of ["resume", "restart"]) find(how).addEventListener("click", () => sendProgram(how));
  find("machine").addEventListener("keydown", keyDown);
  // Firefox presses a button when the space bar goes up.
  find("machine").addEventListener("keyup", (e) => { if (e.key === " " && cutRuns() && e.target.matches("button")) e.preventDefault(); });
}

// ---- Showing ----
function showTool(cut) {
  const at = cut.tool, mark = find("tool");
  setPicture(find("under"), cut.under);
  // Away from the lens, at the machine's own zero, say, there is nothing to see.
  const near = at && at.every((v) => v > -0.2 && v < 1.2);
  setHidden(mark, !near);
  if (!near) return;
  mark.style.left = `${100 * at[0]}%`;
  mark.style.top = `${100 * at[1]}%`;
  machine.trail.push(at.map((v) => v.toFixed(4)).join(","));
  if (machine.trail.length > kTrail) machine.trail.shift();
  setAttribute(find("trail").firstElementChild, "points", machine.trail.join(" "));
}

const axisText = (value) => value.toFixed(3).replace("-", "−");

function cutNumbers(cut) {
  const [feed, rapids, spindle] = cut.overrides || [null, null, null];
  const scaled = (value, unit, share) => (value === null || value === undefined ? "–" : `${Math.round(value)} ${unit}`) + (share === null ? "" : ` · ${share} %`);
  return [
    ...["X", "Y", "Z"].map((axis, i) => [axis, cut.position ? `${axisText(cut.position[i])} mm` : "–"]),
    ["Feed", scaled(cut.feed, "mm/min", feed)], ["Spindle", scaled(cut.rpm, "rpm", spindle)], ["Rapids", rapids === null ? "–" : `${rapids} %`], ["Line", String(cut.line ?? "–")],
  ];
}

function showNumbers(rows) {
  const list = find("cut-numbers");
  if (list.children.length !== rows.length) list.replaceChildren(...rows.map(([name]) => make("div", {}, make("dt", { text: name }), make("dd"))));
  rows.forEach(([, value], i) => setText(list.children[i].lastElementChild, value));
}

const kCutWords = { running: "runs", done: "is done", failed: "failed", interrupted: "was ended" };

function showCut(cut) {
  setHidden(find("cut"), !cut);
  if (!cut) return;
  if (machine.program !== `${cut.program} ${cut.port}`) machine.trail = [];
  machine.program = `${cut.program} ${cut.port}`;
  const runs = cut.status === "running", share = Math.min(100, Math.max(0, cut.percent || 0));
  showTool(cut);
  setText(find("cut-state"), runs ? cut.state || "starts" : kCutWords[cut.status] || cut.status);
  find("cut-state").dataset.state = runs ? cut.state || "" : cut.status;
  setAttribute(find("cut-bar"), "aria-valuenow", Math.round(share));
  find("cut-bar").firstElementChild.style.width = `${share}%`;
  setText(find("cut-progress"), `${share.toFixed(1)} % of ${cut.program} on ${cut.port}` + (runs && cut.left ? `, ${minutesText(cut.left / 60)} left` : ""));
  setText(find("tool-words"), cut.tool ? "The dot is the tool, over the lens as the cutter sees it." : "The lens as the cutter sees it.");
  setHidden(find("unfinished"), !cut.unfinished);
  showNumbers(cutNumbers(cut));
  for (const button of find("keys").querySelectorAll("button")) setAttribute(button, "aria-disabled", !runs);
  const said = (cut.messages || []).concat(cut.status === "failed" && cut.message ? [cut.message] : []);
  rebuild(find("cut-messages"), said, (lines) => lines.map((text) => make("li", { text })));
  const heard = `${cut.status} ${cut.state}`;
  if (machine.status !== heard && machine.status) say(`${cut.program} ${kCutWords[cut.status]}${runs && cut.state ? `: ${cut.state}` : ""}.`);
  machine.status = heard;
}

// "cam-front/rough.ngc" is of the front's setup, "rough.ngc" of the back's, or of the only one.
function programText(name, twoSetups) {
  const [file, folder] = name.split("/").reverse();
  return twoSetups ? `${folder ? "front" : "back"}: ${file}` : file;
}

function showMachineStep(state) {
  const select = find("program"), chosen = select.value, fronts = state.front ? state.front.programs : [], programs = [...fronts, ...(state.part ? state.part.programs : [])];
  rebuild(select, programs, (names) => (names.length ? names : [""]).map((name) => make("option", { value: name, text: name ? programText(name, fronts.length > 0) : "none yet: cut the part first" })));
  if (programs.includes(chosen)) select.value = chosen;
  find("send-button").disabled = !programs.length || cutRuns();
  showCut(state.cut);
}
