# SPDX-License-Identifier: GPL-3.0-or-later
"""The commands as functions: what they return, and what they leave in folders."""

import pickle
import struct
import tempfile
import unittest
from pathlib import Path

import numpy as np

import lensforge
import small_lens


class Design(unittest.TestCase):
    def test_lens_has_the_arrays_that_its_page_promises(self):
        lens = small_lens.lens()
        self.assertEqual(lens.vertices.dtype, np.float64)
        self.assertEqual(lens.faces.dtype, np.int32)
        self.assertEqual(lens.vertices.shape[1], 3)
        self.assertEqual(lens.faces.shape[1], 3)
        self.assertLess(lens.faces.max(), len(lens.vertices))
        for picture in (lens.target, lens.projected):
            self.assertEqual(picture.dtype, np.float32)
            self.assertEqual(picture.shape, (24, 24))
        self.assertEqual(lens.setup.pixels, (24, 24))
        self.assertEqual(lens.setup.lens_size, (12.0, 12.0))
        self.assertLess(lens.metrics[lens.model]["mae"], 0.05)

    def test_its_arrays_are_the_librarys_own_memory_and_do_not_change(self):
        lens = small_lens.lens()
        for array in (lens.vertices, lens.faces, lens.target, lens.projected):
            self.assertFalse(array.flags.owndata)
            self.assertFalse(array.flags.writeable)
        self.assertTrue(np.shares_memory(lens.vertices, lens.vertices))
        self.assertTrue(np.shares_memory(lens.projected, lens.projected))

    def test_a_lens_of_two_pictures_has_both(self):
        self.assertIsNone(small_lens.lens().second_target)
        first, second = np.ones((8, 8), np.float32), small_lens.PICTURE
        lens = lensforge.design(first, second=second, second_focal=90, pixels=8, width=12, thickness=12,
                                focal=30, quality="draft")
        self.assertEqual(lens.second_target.shape, (8, 8))
        self.assertLess(np.abs(lens.second_target - lens.second_projected).mean(), 0.05)
        self.assertGreater(np.abs(lens.second_target - lens.target).mean(), 0.05)
        self.assertFalse(lens.second_projected.flags.writeable)
        # Its light on the second screen, and between both.
        there = lensforge.render(lens, at=90)
        np.testing.assert_allclose(there / there.mean(), lens.second_projected / lens.second_projected.mean(), atol=1e-5)
        self.assertGreater(np.abs(lensforge.render(lens, at=50) - lens.projected).mean(), 1e-3)
        with self.assertRaisesRegex(lensforge.InputError, "^at: cannot be given with focal"):
            lensforge.render(lens, at=50, focal=60)
        again = pickle.loads(pickle.dumps(lens))
        self.assertEqual(again, lens)
        np.testing.assert_array_equal(again.second_projected, lens.second_projected)

    def test_three_lamps_make_a_picture_in_colour(self):
        rows, columns = np.mgrid[0:16, 0:16] / 15.0
        picture = np.stack([0.2 + 0.6 * rows, 0.2 + 0.6 * columns, 0.8 - 0.6 * rows], axis=2)
        options = {"pixels": 16, "width": 12, "focal": 80, "quality": "draft", "threads": 2}
        made = lensforge.three_lamps(picture, lamp_gap=9, **options)
        lamps = made.color["lamps"]
        self.assertEqual([lamp["lens"] for lamp in lamps], ["red", "green", "blue"])
        self.assertAlmostEqual(sum(lamp["share_of_watts"] for lamp in lamps), 1.0)
        self.assertLess(made.color["delta_e"]["mean"], 2.0)
        for lens, lamp in zip(made[:3], lamps):
            self.assertEqual(lens.projected.shape, (16, 16))
            setup = lens.setup.to_dict()
            self.assertEqual(setup["spectrum"]["wavelengths_nm"], [lamp["wavelength_nm"]])
            # Side by side, with their pictures at one place.
            self.assertAlmostEqual(setup["image_origin"][0], -lamp["x_mm"])
        self.assertEqual([lamp["x_mm"] for lamp in lamps], [-21.0, 0.0, 21.0])
        self.assertGreater(np.abs(made.red.target - made.blue.target).mean(), 0.1)

    def test_three_lamps_refuse_what_has_nothing_for_one(self):
        red = np.zeros((8, 8, 3), np.uint8)
        red[..., 0] = 255
        with self.assertRaisesRegex(lensforge.InputError, "picture: has nothing for the green lamp"):
            lensforge.three_lamps(red, lamps=(600, 525, 465))
        with self.assertRaisesRegex(lensforge.InputError, "lamps 465,525,625"):
            lensforge.three_lamps(red, lamps=(465, 525, 625))
        with self.assertRaisesRegex(TypeError, "unexpected keyword argument 'second'"):
            lensforge.three_lamps(red, second="other.png")

    def test_a_view_outlives_its_lens(self):
        picture = np.ones((8, 8), np.float32)
        vertices = lensforge.design(picture, rounds=1, quality="draft").vertices
        self.assertTrue(np.isfinite(vertices).all())

    def test_a_picture_can_be_an_array(self):
        by_array = lensforge.design(small_lens.lens().target, **small_lens.OPTIONS)
        np.testing.assert_array_equal(by_array.target, small_lens.lens().target)
        np.testing.assert_array_equal(by_array.vertices, small_lens.lens().vertices)

    def test_its_provenance_says_what_it_was_made_with(self):
        provenance = small_lens.lens().provenance
        self.assertEqual(provenance["status"], "done")
        self.assertEqual(provenance["options"]["pixels"], 24)

    def test_it_shows_itself_as_a_picture(self):
        png = small_lens.lens()._repr_png_()
        self.assertEqual(png[:8], b"\x89PNG\r\n\x1a\n")
        width, height = struct.unpack(">II", png[16:24])
        self.assertGreater(width, 2 * height)
        self.assertIn("24 x 24 pixels", repr(small_lens.lens()))


class Folder(unittest.TestCase):
    def setUp(self):
        place = tempfile.TemporaryDirectory()
        self.addCleanup(place.cleanup)
        self.place = Path(place.name)

    def test_a_saved_lens_reads_back_as_the_same(self):
        lens = lensforge.design(small_lens.PICTURE, **small_lens.OPTIONS)
        self.assertIsNone(lens.folder)
        lens.save(self.place / "lens")
        self.assertEqual(lens.folder, self.place / "lens")
        read = lensforge.Lens(self.place / "lens")
        np.testing.assert_array_equal(read.vertices, lens.vertices)
        np.testing.assert_array_equal(read.faces, lens.faces)
        np.testing.assert_array_equal(read.projected, lens.projected)
        self.assertEqual(read.metrics, lens.metrics)
        self.assertTrue((self.place / "lens" / "overview.png").exists())
        with self.assertRaisesRegex(lensforge.InputError, "holds a lens already"):
            read.save(self.place / "lens")
        read.save(self.place / "lens", force=True)

    def test_render_gives_the_lenss_picture_and_others(self):
        lens = small_lens.lens()
        picture = lensforge.render(lens)
        self.assertEqual((picture.dtype, picture.shape), (np.float32, (24, 24)))
        np.testing.assert_allclose(picture, lens.projected, rtol=1e-5, atol=1e-7)
        large = lensforge.render(lens, pixels=48, model="facet")
        self.assertEqual(large.shape, (48, 48))
        self.assertAlmostEqual(float(large.mean() / lens.target.mean()), 1.0, delta=0.05)

    def test_export_writes_the_file(self):
        lens = lensforge.design(small_lens.PICTURE, **small_lens.OPTIONS)
        lens.save(self.place / "lens")
        report = lensforge.export(lens, self.place / "lens.stl")
        self.assertEqual(report["format"], "stl")
        self.assertGreater((self.place / "lens.stl").stat().st_size, 1000)

    def test_cam_writes_programs_and_tells_of_them(self):
        lens = lensforge.design(small_lens.PICTURE, **small_lens.OPTIONS)
        lens.save(self.place / "lens")
        cut = lensforge.cam(self.place / "lens", pitch=0.3, sample_spacing=0.03)
        for file in cut["files"]:
            self.assertTrue(Path(file).exists(), file)
        self.assertIn("finish", [operation["name"] for operation in cut["report"]["operations"]])

    def test_cam_with_a_workshop_writes_into_the_lens_folder(self):
        lens = lensforge.design(small_lens.PICTURE, **small_lens.OPTIONS)
        lens.save(self.place / "lens")
        shop = self.place / "shop.toml"
        shop.write_text("[finish]\npitch = 0.3\n")
        cut = lensforge.cam(lens, workshop=shop, sample_spacing=0.03)
        self.assertEqual(cut["report"]["job"], "lens")
        for file in cut["files"]:
            self.assertEqual(Path(file).parent, self.place / "lens" / "cam")


if __name__ == "__main__":
    unittest.main()
