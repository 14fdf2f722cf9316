# SPDX-License-Identifier: GPL-3.0-or-later
"""The program in README.md and those in examples/ run as they stand."""

import os
import re
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import lensforge
import small_lens

ROOT = Path(__file__).resolve().parents[2]


def run(arguments, place):
    done = subprocess.run([sys.executable, *arguments], cwd=place, capture_output=True, text=True)
    if done.returncode != 0:
        raise AssertionError(f"{arguments} ended with {done.returncode}:\n{done.stderr}")
    return done.stdout


class Examples(unittest.TestCase):
    def setUp(self):
        place = tempfile.TemporaryDirectory()
        self.addCleanup(place.cleanup)
        self.place = Path(place.name)

    def test_the_program_in_the_readme_runs(self):
        programs = re.findall(r"```python\n(.*?)```", (ROOT / "README.md").read_text(), re.DOTALL)
        self.assertEqual(len(programs), 1)
        self.assertLessEqual(len(programs[0].splitlines()), 5)
        (self.place / "portrait.png").symlink_to(small_lens.PICTURE)
        (self.place / "program.py").write_text(programs[0])
        run(["program.py"], self.place)
        self.assertTrue((self.place / "lens.stl").exists())
        self.assertEqual(lensforge.Lens(self.place / "lens").folder, self.place / "lens")

    def test_descend_lowers_the_error_by_the_gradient(self):
        example = ROOT / "examples" / "descend.py"
        self.assertLessEqual(len(example.read_text().splitlines()), 40)
        small_lens.lens().save(self.place / "lens")
        for arguments in ([self.place / "lens"], []):
            with self.subTest(arguments=arguments):
                printed = run([example, *arguments], self.place)
                errors = [float(number) for number in re.findall(r"error (\S+)", printed)]
                self.assertGreater(len(errors), 2)
                self.assertLess(errors[-1], errors[0])


if __name__ == "__main__":
    unittest.main()
