# SPDX-License-Identifier: GPL-3.0-or-later
"""Designs pictures with several surface models, and judges what is cut and what is exported.

model_table.py BUILD DIR PICTURE... [--pixels N] [--width MM] [--focal MM] [--models NAME...]

Prints a row for every picture and model: processor seconds of the design, and display-encoded MAE of the
design by its own model, of its surface as `cam` takes it, of that surface polished and of the part that is
cut and polished, by `cam`, and of the solid in a STEP file. Lenses go to DIR; figures that are there are
not measured again.
"""

import argparse
import json
import resource
import subprocess
from pathlib import Path

# Samples of the milled surface, mm: twice the default's spacing, for a third of the time.
SAMPLE_SPACING = 0.02
SURFACES = {"one surface": "designed", "polish alone": "polish", "part": "polished"}
HEAD = ["design s", "MAE", *SURFACES, "solid", "STEP s", "exit code", "MB"]


def processor_seconds():
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def run(build, *words):
    """Seconds, exit code (0, or 3 for a limit that was missed) and JSON result of a command."""
    before = processor_seconds()
    words = [f"{build}/lensforge", *map(str, words), "--threads", "1", "--json"]
    done = subprocess.run(words, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, check=False)
    if done.returncode not in (0, 3):
        raise SystemExit(f"{' '.join(words)}: exit code {done.returncode}")
    return processor_seconds() - before, done.returncode, json.loads(done.stdout)


def text(figure):
    if isinstance(figure, int):
        return str(figure)
    return f"{figure:.5f}" if figure < 0.5 else f"{figure:.1f}"


def measure(options, picture, model, lens):
    size = ["--width", options.width, "--focal", options.focal]
    figures = {}
    figures["design s"], _, design = run(
        options.build, "design", picture, "--out", lens, "--pixels", options.pixels, "--model", model, *size,
        "--force")
    figures["MAE"] = design["metrics"][model]["mae"]
    run(options.build, "cam", lens, "--no-rough", "--no-semi", "--sample-spacing", SAMPLE_SPACING, "--force")
    with open(lens / "cam" / "report.json", encoding="utf-8") as file:
        found = {surface["name"]: surface["mae"] for surface in json.load(file)["surfaces"]}
    figures |= {name: found[surface] for name, surface in SURFACES.items()}
    solid = lens / "lens.step"
    figures["STEP s"], figures["exit code"], _ = run(options.build, "export", lens, "--out", solid)
    figures["MB"] = solid.stat().st_size / 1e6
    _, _, rendered = run(
        options.build, "render", solid, "--target", lens / "target.exr", "--focal", options.focal, "--pixels",
        options.pixels, "--out", lens / "solid.png")
    figures["solid"] = rendered["metrics"]["smooth"]["mae"]
    return figures


def main():
    arguments = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    arguments.add_argument("build")
    arguments.add_argument("dir", type=Path)
    arguments.add_argument("pictures", type=Path, nargs="+")
    arguments.add_argument("--pixels", type=int, default=64)
    arguments.add_argument("--width", type=float, default=25.0)
    arguments.add_argument("--focal", type=float, default=75.0)
    arguments.add_argument("--models", nargs="+", default=["smooth", "spline"])
    options = arguments.parse_args()
    print("| lens |", " | ".join(HEAD), "|\n" + "| --- " * (1 + len(HEAD)) + "|")
    for picture in options.pictures:
        for model in options.models:
            lens = options.dir / f"{picture.stem}-{options.pixels}-{model}"
            file = lens / "figures.json"
            if not file.exists():
                file.write_text(json.dumps(measure(options, picture, model, lens)), encoding="utf-8")
            figures = json.loads(file.read_text(encoding="utf-8"))
            print(f"| {lens.name} |", " | ".join(text(figures[name]) for name in HEAD), "|", flush=True)


if __name__ == "__main__":
    main()
