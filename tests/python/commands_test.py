# SPDX-License-Identifier: GPL-3.0-or-later
"""The other commands as functions: they write and return what the commands do."""

import json
import os
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import numpy as np

import lensforge
import small_lens

CUT = {"pitch": 0.3, "sample_spacing": 0.03}


def command(*arguments):
    told = subprocess.run([os.environ["LENSFORGE_COMMAND"], *map(str, arguments), "--json"],
                          capture_output=True, text=True)
    return json.loads(told.stdout)


class Commands(unittest.TestCase):
    def setUp(self):
        place = tempfile.TemporaryDirectory()
        self.addCleanup(place.cleanup)
        self.place = Path(place.name)
        self.lens = lensforge.design(small_lens.PICTURE, **small_lens.OPTIONS)
        self.lens.save(self.place / "lens")

    def test_info_says_what_the_command_says(self):
        for source in (self.place / "lens", self.place / "lens" / "surface.ply", small_lens.PICTURE):
            told = command("info", source)
            del told["command"]
            self.assertEqual(lensforge.info(source), told)
        self.assertEqual(lensforge.info(self.lens)["kind"], "lens")
        with self.assertRaisesRegex(TypeError, "unexpected keyword argument 'threads'"):
            lensforge.info(self.lens, threads=1)

    def test_view_writes_a_page(self):
        page = self.place / "page.html"
        told = lensforge.view(self.lens, page)
        self.assertEqual(told["bytes"], page.stat().st_size)
        self.assertIn("surfaces", told)
        with self.assertRaisesRegex(lensforge.InputError, "^out .*must end in .html"):
            lensforge.view(self.lens, self.place / "page.txt")

    def test_nest_makes_programs_for_several_lenses(self):
        told = lensforge.nest([self.lens, self.place / "lens"], self.place / "nest",
                              blank=(100, 60), **CUT)
        self.assertEqual([lens["name"] for lens in told["lenses"]], ["lens", "lens_2"])
        for file in told["files"]:
            self.assertTrue(Path(file).exists(), file)
        with self.assertRaisesRegex(lensforge.InputError, "^blank: is required"):
            lensforge.nest([self.lens], self.place / "other")

    def test_coupon_writes_a_test_piece(self):
        told = lensforge.coupon(self.place / "coupon")
        self.assertGreater(len(told["files"]), 1)
        self.assertIn("polish.sigma", told["expected"])
        with self.assertRaisesRegex(FileNotFoundError, "readings.toml"):
            lensforge.coupon(self.place / "shop.toml", fit=self.place / "readings.toml")

    def test_reflect_evaluates_and_deforms_a_mesh(self):
        mesh = self.place / "tetrahedron.off"
        mesh.write_text("OFF\n4 4 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n")
        before = lensforge.reflect(mesh, evaluate=True)
        self.assertGreaterEqual(before["energy"], before["energy_direct"])
        heard = []
        told = lensforge.reflect(mesh, self.place / "shape", faces=200, rim_updates=2, face_updates=2,
                                 progress=lambda *report: heard.append(report))
        self.assertGreater(len(heard), 0)
        for file in told["files"]:
            self.assertTrue(Path(file).exists(), file)

    def test_batch_does_jobs(self):
        options = {key: value for key, value in small_lens.OPTIONS.items() if key != "threads"}
        job = {"name": "a", "command": "design", "target": small_lens.PICTURE, "options": options}
        heard = []
        told = lensforge.batch([job], self.place / "out", grid={"focal": [60, 70]},
                               progress=lambda *report: heard.append(report))
        self.assertEqual([(j["name"], j["status"]) for j in told["jobs"]],
                         [("a-focal60", "done"), ("a-focal70", "done")], told)
        self.assertEqual(heard[-1], ("batch", 2.0, 2.0))
        made = lensforge.Lens(self.place / "out" / "a-focal60")
        np.testing.assert_array_equal(made.vertices, self.lens.vertices)
        file = self.place / "jobs.jsonl"
        file.write_text(json.dumps({**job, "target": "nowhere.png"}, default=str))
        with self.assertRaisesRegex(lensforge.InputError, "nowhere.png"):
            lensforge.batch(file, self.place / "out")

    def test_the_package_runs_as_the_command(self):
        told = subprocess.run([sys.executable, "-m", "lensforge", "info", self.place / "lens", "--json"],
                              capture_output=True, text=True)
        self.assertEqual(told.returncode, 0, told.stderr)
        self.assertEqual(json.loads(told.stdout), command("info", self.place / "lens"))
        wrong = subprocess.run([sys.executable, "-m", "lensforge", "info"], capture_output=True)
        self.assertEqual(wrong.returncode, 2)


if __name__ == "__main__":
    unittest.main()
