# SPDX-License-Identifier: GPL-3.0-or-later
"""Lenses and setups can be compared, copied and pickled."""

import copy
import pickle
import tempfile
import unittest
from pathlib import Path

import numpy as np

import lensforge
import small_lens

SETUPS = {
    "usual": {},
    "point": {"source": "point", "source_position": (10.0, 8.0, -120.0), "source_size": 2.0},
    "mirror": {"mode": "reflect", "incidence": 20.0},
    "moved": {"image_offset": (3, 0.1), "view": "rear", "fresnel": True, "ior": 1.5},
}


class Setups(unittest.TestCase):
    def test_come_back_from_a_pickle(self):
        for name, options in SETUPS.items():
            with self.subTest(setup=name):
                setup = lensforge.Setup(24, 18, width=20.0, focal=80.0, **options)
                again = pickle.loads(pickle.dumps(setup))
                self.assertEqual(again, setup)
                self.assertEqual(hash(again), hash(setup))
                self.assertEqual(again.to_dict(), setup.to_dict())
                self.assertEqual(copy.deepcopy(setup), setup)
                self.assertEqual(copy.copy(setup), setup)

    def test_differ_by_any_option(self):
        setups = [lensforge.Setup(24, 18, width=20.0, focal=80.0, **o) for o in SETUPS.values()]
        for i, one in enumerate(setups):
            self.assertEqual([one == other for other in setups], [i == k for k in range(len(setups))])
        self.assertNotEqual(setups[0], "a setup")

    def test_a_front_of_heights_is_kept(self):
        with tempfile.TemporaryDirectory() as place:
            heights = Path(place) / "front.pfm"
            values = np.linspace(-0.2, 0, 64, dtype="<f4").tobytes()
            heights.write_bytes(b"Pf\n8 8\n-1.0\n" + values)
            lens = lensforge.design(small_lens.PICTURE, **small_lens.OPTIONS, front=heights)
        self.assertEqual(lens.setup.to_dict()["front"]["type"], "heights")
        self.assertEqual(pickle.loads(pickle.dumps(lens.setup)), lens.setup)
        self.assertEqual(pickle.loads(pickle.dumps(lens)), lens)
        self.assertNotEqual(lens.setup, small_lens.lens().setup)


class Lenses(unittest.TestCase):
    def same(self, one, other):
        self.assertEqual(one, other)
        self.assertEqual(hash(one), hash(other))
        for name in ("vertices", "faces", "target", "projected"):
            np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
        self.assertEqual(one.metrics, other.metrics)
        self.assertEqual(one.provenance, other.provenance)
        self.assertEqual((one.model, one.folder, one.setup), (other.model, other.folder, other.setup))

    def test_come_back_from_a_pickle(self):
        lens = small_lens.lens()
        self.same(pickle.loads(pickle.dumps(lens)), lens)

    def test_a_pickled_lens_can_be_saved_and_remembers_its_folder(self):
        lens = copy.deepcopy(small_lens.lens())
        with tempfile.TemporaryDirectory() as place:
            lens.save(Path(place) / "lens")
            again = pickle.loads(pickle.dumps(lens))
            self.same(again, lens)
            again.save(Path(place) / "again")
            self.assertEqual(lensforge.Lens(Path(place) / "again"), lens)

    def test_copies_are_lenses_of_their_own(self):
        lens = small_lens.lens()
        for made in (copy.copy(lens), copy.deepcopy(lens)):
            self.same(made, lens)
            with tempfile.TemporaryDirectory() as place:
                made.save(place, force=True)
                self.assertEqual(made.folder, Path(place))
                self.assertNotEqual(lens.folder, Path(place))

    def test_differ_by_their_surface(self):
        other = lensforge.design(small_lens.PICTURE, **{**small_lens.OPTIONS, "focal": 61.0})
        self.assertNotEqual(other, small_lens.lens())
        self.assertNotEqual(small_lens.lens(), "a lens")


if __name__ == "__main__":
    unittest.main()
