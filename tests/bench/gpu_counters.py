# SPDX-License-Identifier: GPL-3.0-or-later
"""Prints the median counters of every kernel from the CSV that ncu writes."""

import csv
import re
import statistics
import sys

TIME = "gpu__time_duration.sum"
BYTES = "dram__bytes.sum"
MEMORY = "dram__throughput.avg.pct_of_peak_sustained_elapsed"
DOUBLES = "sm__inst_executed_pipe_fp64.avg.pct_of_peak_sustained_active"

SCALES = {"ns": 1e-3, "nsecond": 1e-3, "us": 1.0, "usecond": 1.0, "ms": 1e3, "msecond": 1e3,
          "byte": 1e-6, "Kbyte": 1e-3, "Mbyte": 1.0, "Gbyte": 1e3, "%": 1.0}


def short_name(kernel):
    """The functor that a kernel calls, else the kernel's own name."""
    functor = re.search(r"lensforge::([A-Z]\w+)", kernel)
    if functor:
        return functor.group(1)
    return re.sub(r"[<(].*", "", kernel).split("::")[-1].split(" ")[-1][:28]


def read(path):
    with open(path, newline="", encoding="utf-8") as file:
        lines = [line for line in file if line.startswith('"')]
    kernels = {}
    for row in csv.DictReader(lines):
        value = float(row["Metric Value"].replace(",", "")) * SCALES.get(row["Metric Unit"], 1.0)
        metrics = kernels.setdefault(short_name(row["Kernel Name"]), {})
        metrics.setdefault(row["Metric Name"], []).append(value)
    return kernels


def main():
    print(f"\n{'kernel (counters)':<28}{'us':>10}{'DRAM MB':>10}{'DRAM':>8}{'doubles':>9}")
    for name, metrics in sorted(read(sys.argv[1]).items()):
        middle = [statistics.median(metrics.get(m, [0.0])) for m in (TIME, BYTES, MEMORY, DOUBLES)]
        print(f"{name:<28}{middle[0]:>10.1f}{middle[1]:>10.2f}{middle[2]:>7.0f}%{middle[3]:>8.0f}%")


if __name__ == "__main__":
    main()
