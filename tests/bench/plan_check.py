#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes what `lensforge plan` proposes, and prints forecast beside result.

    plan_check.py LENSFORGE OUT PICTURE... [-- OPTIONS of plan]

Designs the first proposal of each picture into OUT, and cuts it or computes its print; one row each: MAE, minutes and
relief as planned and as made, with their ratios. Of a print (OPTIONS with --part print) MAE and relief; it needs
cam_bench/print_check beside LENSFORGE.
"""
import json
import pathlib
import shlex
import subprocess
import sys


def called(words):
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    if done.returncode not in (0, 3):
        sys.exit(f"{shlex.join(words)}: {done.stderr}")
    return done.stdout


def row_of(program, folder, picture, options):
    plan = json.loads(called([program, "plan", picture, "--json", *options]))["proposals"][0]
    lens = str(folder / pathlib.Path(picture).stem)
    words = shlex.split(plan["commands"][0])[1:]
    words[words.index("--out") + 1] = lens
    called([program, *words, "--force", "--quiet"])
    pairs = of_print(program, lens, plan, words) if "print" in plan else of_cut(program, lens, plan, words)
    cells = "".join(f" {planned:9.4f} {real:9.4f} {planned / real:5.2f} |" for planned, real in pairs)
    return f"| {pathlib.Path(picture).stem:12} | {plan['pixels']:4} |{cells}"


def of_cut(program, lens, plan, words):
    called([program, "cam", lens, "--no-remedies", "--quiet"])
    report = json.loads((pathlib.Path(lens) / "cam" / "report.json").read_text())
    judged = report["waves"] if report["light"]["model"] == "waves" else report
    made = {one["name"]: one for one in judged["surfaces"]}["polished"]["mae"]
    relief = report["setup"]["part"]["max"][2] - plan_thickness(words)
    return [(plan["mae"], made), (plan["minutes"], report["minutes"]), (plan["relief_mm"], relief)]


def of_print(program, lens, plan, words):
    check = str(pathlib.Path(program).parent / "cam_bench" / "print_check")
    shop = words[words.index("--made-by") + 1]
    made = json.loads(called([check, lens, *([] if shop == "default" else [shop])]))
    return [(plan["mae"], made["mae"]), (plan["relief_mm"], made["relief_mm"])]


def plan_thickness(words):
    return float(words[words.index("--thickness") + 1]) if "--thickness" in words else 5.0


def main(arguments):
    end = arguments.index("--") if "--" in arguments else len(arguments)
    program, out, *pictures = arguments[:end]
    folder = pathlib.Path(out)
    folder.mkdir(parents=True, exist_ok=True)
    minutes = "" if "print" in arguments[end:] else " minutes |"
    print(f"| picture | pixels | MAE planned, made, ratio |{minutes} relief, mm |")
    for picture in pictures:
        print(row_of(program, folder, picture, arguments[end + 1:]), flush=True)


main(sys.argv[1:])
