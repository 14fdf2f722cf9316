// SPDX-License-Identifier: GPL-3.0-or-later
// Asks the running design for its state and shows it.

const find = (name) => document.querySelector(`[data-${name}]`);
let shown = 0;

function show(state) {
  find("round").textContent = state.words;
  if (state.number === shown) return;
  shown = state.number;
  find("picture").src = `/picture.png?${shown}`;
  find("error").src = `/error.png?${shown}`;
  find("error").hidden = false;
  find("light").textContent = `${state.rounds ? `after round ${state.rounds}` : "before the first round"}, MAE ${state.mae.toFixed(4)}`;
  find("chart").innerHTML = state.plot;
}

async function ask() {
  try {
    const answer = await fetch("/state.json");
    if (answer.ok) show(await answer.json());
    setTimeout(ask, 500);
  } catch (e) {
    find("round").textContent = "the design has ended";
    find("stop").disabled = true;
    find("said").textContent = "The lens folder holds what was reached.";
  }
}

find("stop").addEventListener("click", async () => {
  find("stop").disabled = true;
  find("said").textContent = "Stops after this step …";
  await fetch("/stop", { method: "POST", headers: { "X-Lensforge": "stop" } }).catch(() => {});
});
ask();
