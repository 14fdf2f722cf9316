// SPDX-License-Identifier: GPL-3.0-or-later
// New projects: a picture that is chosen, dropped or pasted, or a text.

function letterFont() {
  return `${find("letters-bold").checked ? "bold " : ""}${find("letters-size").value || 140}px ${find("letters-font").value}`;
}

// Light letters on black: the light writes.
function drawLetters() {
  const canvas = find("letters-canvas"), context = canvas.getContext("2d"), size = Number(find("letters-size").value) || 140;
  const lines = find("letters-text").value.split("\n");
  context.font = letterFont();
  const margin = Math.round(0.45 * size), wide = Math.max(1, ...lines.map((text) => context.measureText(text).width));
  canvas.width = Math.min(4096, Math.ceil(wide + 2 * margin));
  canvas.height = Math.min(4096, Math.ceil(1.18 * size * lines.length + 1.2 * margin));
  context.fillStyle = "#000";
  context.fillRect(0, 0, canvas.width, canvas.height);
  Object.assign(context, { font: letterFont(), fillStyle: "#fff", textAlign: "center", textBaseline: "middle" });
  lines.forEach((text, i) => context.fillText(text, canvas.width / 2, canvas.height / 2 + 1.18 * size * (i - (lines.length - 1) / 2)));
  setText(find("letters-note"), `${canvas.width} × ${canvas.height} pixels`);
  setAttribute(canvas, "aria-label", `The text as a picture: ${find("letters-text").value}`);
}

async function newProject(content, title) {
  showError(0, "");
  try {
    const made = await post(`/projects?title=${encodeURIComponent(find("new-name").value.trim() || title)}`, content);
    find("new-name").value = "";
    await openProject(made.name);
    find("name").focus();
    say(`Project ${made.name} is there.`);
  } catch (e) {
    startProject();
    showError(0, e instanceof Refusal ? e.message : "The studio did not answer; the picture was not stored.");
  }
}

const titleOf = (file) => (file.name || "picture").replace(/\.[^.]*$/, "");

function takeFile(file) {
  if (file) newProject(file, titleOf(file));
}

function listenToDrops() {
  // A link or a text that is dragged over the page is none of ours.
  const hasFile = (e) => [...(e.dataTransfer ? e.dataTransfer.types : [])].includes("Files");
  document.addEventListener("dragover", (e) => {
    if (!hasFile(e)) return;
    e.preventDefault();
    document.body.classList.add("dropping");
  });
  document.addEventListener("dragleave", (e) => { if (!e.relatedTarget) document.body.classList.remove("dropping"); });
  document.addEventListener("drop", (e) => {
    document.body.classList.remove("dropping");
    if (!hasFile(e)) return;
    e.preventDefault();
    takeFile(e.dataTransfer.files[0]);
  });
  document.addEventListener("paste", (e) => takeFile([...e.clipboardData.files][0]));
}

function makeStart() {
  find("new").addEventListener("click", () => startProject(true));
  find("new-file").addEventListener("change", (e) => {
    takeFile(e.target.files[0]);
    e.target.value = "";
  });
  find("letters").addEventListener("input", drawLetters);
  find("letters").addEventListener("submit", async (e) => {
    e.preventDefault();
    const text = find("letters-text").value.trim();
    if (!text) return showError(0, "Write a text first.");
    drawLetters();
    newProject(await pngOf(find("letters-canvas")), text.split("\n")[0].slice(0, 40));
  });
  drawLetters();
  listenToDrops();
}
