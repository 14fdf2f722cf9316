# SPDX-License-Identifier: GPL-3.0-or-later
"""Arrays and PIL pictures stand for the same light as files."""

import struct
import tempfile
import unittest
import zlib
from pathlib import Path

import numpy as np

import lensforge

OPTIONS = {"pixels": 16, "rounds": 1, "quality": "draft", "width": 12.0, "focal": 60.0}


def linear(encoded):
    """The standard's curve (IEC 61966-2-1)."""
    return np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)


def target(picture, **options):
    return lensforge.design(picture, **OPTIONS, **options).target


def png(array):
    """A PNG file of 8 or 16 bits, C channels."""
    rows, columns, channels = array.shape
    kind = {1: 0, 2: 4, 3: 2, 4: 6}[channels]
    big = array.astype(array.dtype.newbyteorder(">"))

    def chunk(name, data):
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))

    header = struct.pack(">IIBBBBB", columns, rows, 8 * array.dtype.itemsize, kind, 0, 0, 0)
    lines = b"".join(b"\0" + row.tobytes() for row in big)
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(lines))
            + chunk(b"IEND", b""))


class Picture:
    """As PIL's: numpy makes an array of it, and other modes are converted."""

    def __init__(self, array, mode):
        self._array = array
        self.mode = mode

    @property
    def __array_interface__(self):
        return self._array.__array_interface__

    def convert(self, mode):
        palette = np.array([[10, 20, 30, 255], [250, 240, 230, 255]], np.uint8)
        assert mode == "RGBA" and self.mode == "P"
        return Picture(np.ascontiguousarray(palette[self._array]), mode)


class Pictures(unittest.TestCase):
    def setUp(self):
        self.random = np.random.default_rng(4)

    def numbers(self, kind, *shape):
        return self.random.integers(0, np.iinfo(kind).max, shape, kind, endpoint=True)

    def test_whole_numbers_are_encoded_by_srgb_and_floats_are_not(self):
        grey = self.numbers(np.uint8, 16, 16)
        np.testing.assert_allclose(target(grey), linear(grey / 255.0), rtol=1e-5, atol=1e-7)
        fine = self.numbers(np.uint16, 16, 16)
        np.testing.assert_allclose(target(fine), linear(fine / 65535.0), rtol=1e-5, atol=1e-7)
        light = self.random.random((16, 16))
        np.testing.assert_array_equal(target(light), light.astype(np.float32))

    def test_colours_become_their_luminance_in_linear_light(self):
        weights = np.array([0.2126, 0.7152, 0.0722])
        colours = self.numbers(np.uint8, 16, 16, 3)
        expected = linear(colours / 255.0) @ weights
        np.testing.assert_allclose(target(colours), expected, rtol=1e-5, atol=1e-7)
        light = self.random.random((16, 16, 3)).astype(np.float32)
        np.testing.assert_allclose(target(light), light @ weights, rtol=1e-5, atol=1e-7)

    def test_arrays_are_read_as_files_are(self):
        with tempfile.TemporaryDirectory() as place:
            for kind in (np.uint8, np.uint16):
                for channels in (1, 2, 3, 4):
                    with self.subTest(kind=kind, channels=channels):
                        array = self.numbers(kind, 16, 16, channels)
                        file = Path(place) / "picture.png"
                        file.write_bytes(png(array))
                        for options in ({}, {"background": "#804020"}):
                            np.testing.assert_allclose(target(array, **options),
                                                       target(file, **options), atol=2e-6)

    def test_background_shows_where_a_picture_is_transparent(self):
        logo = np.zeros((16, 16, 4), np.uint8)
        logo[4:12, 4:12, 3] = 255
        with self.assertRaisesRegex(lensforge.InputError, "black all over.*use background white"):
            target(logo)
        on_white = target(logo, background="white")
        self.assertEqual((on_white[0, 0], on_white[8, 8]), (1.0, 0.0))
        with self.assertRaisesRegex(lensforge.InputError, "alpha of 2: must be 0 to 1"):
            target(np.full((16, 16, 2), 2.0))

    def test_other_layouts_and_lists_are_taken(self):
        grey = self.numbers(np.uint8, 32, 32)
        np.testing.assert_array_equal(target(grey[::2, ::2]), target(grey[::2, ::2].copy()))
        np.testing.assert_array_equal(target(grey[:16, :16].astype(">u2") * 257), target(grey[:16, :16]))
        holes = grey[:16, :16] > 99
        np.testing.assert_array_equal(target(holes), holes.astype(np.float32))
        light = self.random.random((16, 16))
        np.testing.assert_array_equal(target(light.tolist()), target(light))

    def test_pictures_as_of_pil(self):
        colours = self.numbers(np.uint8, 16, 16, 3)
        np.testing.assert_array_equal(target(Picture(colours, "RGB")), target(colours))
        indices = self.random.integers(0, 2, (16, 16), np.uint8)
        palette = np.array([[10, 20, 30], [250, 240, 230]], np.uint8)
        np.testing.assert_array_equal(target(Picture(indices, "P")), target(palette[indices]))

    def test_a_path_may_be_of_pathlib(self):
        with tempfile.TemporaryDirectory() as place:
            file = Path(place) / "picture.png"
            file.write_bytes(png(self.numbers(np.uint8, 16, 16, 3)))
            np.testing.assert_array_equal(target(file), target(str(file)))


if __name__ == "__main__":
    unittest.main()
