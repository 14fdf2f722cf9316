# SPDX-License-Identifier: GPL-3.0-or-later
"""Bad input is a ValueError with the command's own line, keywords for options; a wrong keyword a TypeError."""

import errno
import os
import pickle
import subprocess
import tempfile
import unittest
from pathlib import Path

import numpy as np

import lensforge
import small_lens

FLAT = np.ones((8, 8), np.float32)


class Errors(unittest.TestCase):
    def assert_refused(self, text, function, *arguments, **options):
        with self.assertRaises(lensforge.InputError) as caught:
            function(*arguments, **options)
        self.assertIsInstance(caught.exception, ValueError)
        self.assertIn(text, str(caught.exception))
        self.assertNotIn("\n", str(caught.exception))

    def test_an_option_breaks_its_rule_in_the_commands_words(self):
        with tempfile.TemporaryDirectory() as place:
            command = [os.environ["LENSFORGE_COMMAND"], "design", small_lens.PICTURE, "--width=-1",
                       "--out", Path(place) / "lens"]
            told = subprocess.run(command, capture_output=True, text=True)
        self.assertEqual(told.returncode, 2)
        line = told.stderr.strip().removeprefix("lensforge: ")
        with self.assertRaises(lensforge.InputError) as caught:
            lensforge.design(small_lens.PICTURE, width=-1)
        self.assertEqual(str(caught.exception), line.removeprefix("--"))

    def test_pictures(self):
        self.assert_refused("nowhere.png", lensforge.design, "nowhere.png")
        self.assert_refused("black all over", lensforge.design, 0 * FLAT)
        self.assert_refused("nan", lensforge.design, FLAT * np.nan)
        self.assert_refused("not negative", lensforge.design, -FLAT)
        for picture in (FLAT.astype(np.int32), np.ones((8, 8, 5)), np.ones(8), np.ones((0, 8))):
            self.assert_refused("must be (rows, columns), or", lensforge.design, picture)
        for picture in (None, 3, object(), FLAT.astype(object)):
            with self.assertRaisesRegex(TypeError, "must be a path, an array or a PIL picture"):
                lensforge.design(picture)

    def test_files_that_are_missing(self):
        missing = {
            "nowhere.png": lambda: lensforge.design("nowhere.png"),
            "nowhere.exr": lambda: lensforge.design(FLAT, source_picture="nowhere.exr", source_angle=1),
            "nowhere.toml": lambda: lensforge.design(FLAT, made_by="nowhere.toml"),
            "nowhere/lens.json": lambda: lensforge.Lens("nowhere"),
            "nowhere.stl": lambda: lensforge.reflect("nowhere.stl", evaluate=True),
            "nowhere.ngc": lambda: lensforge.info(Path("nowhere.ngc")),
            "nowhere.jsonl": lambda: lensforge.batch("nowhere.jsonl", "out"),
            "nowhere": lambda: lensforge.cam("nowhere"),
        }
        for name, call in missing.items():
            with self.subTest(file=name), self.assertRaises(FileNotFoundError) as caught:
                call()
            error = caught.exception
            self.assertIsInstance(error, lensforge.MissingFileError)
            self.assertIsInstance(error, lensforge.InputError)
            self.assertIsInstance(error, ValueError)
            self.assertEqual((error.errno, error.filename), (errno.ENOENT, name))
            self.assertRegex(str(error), f"^{name}: cannot be (read|opened): No such file")
            again = pickle.loads(pickle.dumps(error))
            self.assertEqual((type(again), str(again)), (type(error), str(error)))

    def test_messages_name_keywords(self):
        calls = [
            lambda: lensforge.Setup(8, 8, focal=1.0),
            lambda: lensforge.design(FLAT, robust=True),
            lambda: lensforge.design(FLAT, image_width=-1),
            lambda: lensforge.nest([], "out"),
            lambda: lensforge.reflect("a.stl"),
        ]
        words = ["focal 1", "robust: needs made_by", "image_width -1", "DIR: is required", "out: is missing"]
        for call, word in zip(calls, words, strict=True):
            with self.assertRaises(lensforge.InputError) as caught:
                call()
            self.assertIn(word, str(caught.exception))
            self.assertNotIn("--", str(caught.exception))

    def test_a_path_with_dashes_stays_as_it_is(self):
        with self.assertRaisesRegex(FileNotFoundError, "^a--b/--focal.png: cannot be read"):
            lensforge.design("a--b/--focal.png")

    def test_keywords(self):
        with self.assertRaisesRegex(TypeError, "unexpected keyword argument 'wdth'"):
            lensforge.design(FLAT, wdth=3)
        with self.assertRaisesRegex(TypeError, "unexpected keyword argument 'out'"):
            lensforge.design(FLAT, out="somewhere")
        for options in ({"rounds": 1.5}, {"rounds": True}, {"fresnel": 1}, {"width": None}):
            with self.assertRaises(TypeError):
                lensforge.design(FLAT, **options)
        self.assert_refused("model bumpy: must be one of", lensforge.design, FLAT, model="bumpy")

    def test_values_break_the_rules_of_their_options(self):
        rule = "must be above 0, at most"
        for focal in (-1, 0.0, float("nan"), np.float32(-2.5), 10**400, -(10**400), "-1 in"):
            self.assert_refused("focal ", lensforge.Setup, 8, 8, focal=focal)
            self.assert_refused(rule, lensforge.Setup, 8, 8, focal=focal)
        self.assert_refused("width: 'wide' is no length", lensforge.Setup, 8, 8, width="wide")
        self.assert_refused("rounds 99999999999: must be", lensforge.design, FLAT, rounds=99999999999)

    def test_values_of_every_type(self):
        wide = lensforge.Setup(8, 8, width="4in", focal=300, image_width=np.float64(50))
        self.assertEqual(wide.lens_size, (101.6, 101.6))
        self.assertEqual(wide.image_size, (50.0, 50.0))
        moved = lensforge.Setup(8, 8, width=10, focal=50, image_offset=(3, np.float32(0.5)))
        same = lensforge.Setup(8, 8, width=10, focal=50, image_offset="3,0.5")
        self.assertEqual(moved.to_dict(), same.to_dict())
        self.assertNotEqual(moved.to_dict(), lensforge.Setup(8, 8, width=10, focal=50).to_dict())

    def test_arrays_of_a_mesh(self):
        setup = lensforge.Setup(8, 8, width=10.0, focal=50.0)
        points = np.array([[0.0, 0, 5], [1, 0, 5], [0, 1, 5]])
        face = np.array([[0, 1, 2]])
        flux = lensforge.flux_image
        self.assertGreater(flux(points, face, setup).sum(), 0.0)
        self.assert_refused("must be (n, 3) floats", flux, points[:, :2], face, setup)
        self.assert_refused("must be (n, 3) integers", flux, points, face.astype(float), setup)
        self.assert_refused("vertex number 3", flux, points, face + 1, setup)
        self.assert_refused("vertex number -1", flux, points, face - 1, setup)
        self.assert_refused("finite", flux, points + np.inf, face, setup)
        self.assert_refused("model", flux, points, face, setup, "spline")
        self.assert_refused("focal", flux, points + 100, face, setup)
        with self.assertRaisesRegex(TypeError, "must be a Setup"):
            flux(points, face, None)
        with self.assertRaisesRegex(TypeError, "must be a whole number"):
            flux(points, face, setup, threads=1.5)
        self.assert_refused("must be (8, 8)", lensforge.flux_image_vjp, points, face, setup,
                            np.ones((8, 9)))

    def test_setups(self):
        self.assert_refused("columns 0", lensforge.Setup, 0, 8)
        self.assert_refused("focal", lensforge.Setup, 8, 8, focal=1.0)

    def test_folders(self):
        self.assert_refused("nowhere", lensforge.Lens, "nowhere")
        self.assert_refused("save() it first", lensforge.cam, small_lens.lens())


if __name__ == "__main__":
    unittest.main()
