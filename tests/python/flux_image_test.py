# SPDX-License-Identifier: GPL-3.0-or-later
"""The flux picture of a mesh and its vector-Jacobian product, by which others differentiate."""

import unittest

import numpy as np

import lensforge


def rough_mesh(columns, rows, size):
    """A grid mesh with bumps and shaken vertices; its border stays on the lens's rectangle."""
    random = np.random.default_rng(1)
    x, y = np.meshgrid(np.linspace(0, size[0], columns), np.linspace(0, size[1], rows))
    z = 5.0 + 0.05 * np.sin(0.6 * x) * np.cos(0.5 * y)
    # Where the edge of a facet's image lies on a border of pixels, the flux has a kink.
    z += random.uniform(0, 0.002, z.shape)
    x[1:-1, 1:-1] += random.uniform(-0.05, 0.05, (rows - 2, columns - 2))
    y[1:-1, 1:-1] += random.uniform(-0.05, 0.05, (rows - 2, columns - 2))
    corner = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    lower = np.stack([corner, corner + 1, corner + columns + 1], axis=1)
    upper = np.stack([corner, corner + columns + 1, corner + columns], axis=1)
    faces = np.concatenate([lower, upper]).astype(np.int32)
    return np.stack([x.ravel(), y.ravel(), z.ravel()], axis=1), faces


class FluxImage(unittest.TestCase):
    def setUp(self):
        self.setup = lensforge.Setup(24, 18, width=20.0, focal=80.0)
        self.vertices, self.faces = rough_mesh(15, 13, self.setup.lens_size)

    def test_is_shares_of_the_lenss_light(self):
        flux = lensforge.flux_image(self.vertices, self.faces, self.setup)
        self.assertEqual((flux.dtype, flux.shape), (np.float64, (18, 24)))
        self.assertGreater(flux.min(), 0.0 - 1e-12)
        self.assertGreater(flux.sum(), 0.9)
        self.assertLessEqual(flux.sum(), 1.0 + 1e-12)

    def test_takes_any_numeric_arrays_and_keeps_them(self):
        before = self.vertices.copy()
        flux = lensforge.flux_image(self.vertices, self.faces, self.setup)
        strided = np.asfortranarray(self.vertices)
        np.testing.assert_array_equal(
            lensforge.flux_image(strided, self.faces.astype(np.int64), self.setup), flux)
        np.testing.assert_array_equal(self.vertices, before)

    def test_is_the_same_for_any_number_of_threads(self):
        one = lensforge.flux_image(self.vertices, self.faces, self.setup, threads=1)
        two = lensforge.flux_image(self.vertices, self.faces, self.setup, threads=2)
        np.testing.assert_array_equal(one, two)

    def slope_error(self, setup, model):
        """Of the product against central differences of fourth order, relative."""
        random = np.random.default_rng(2)
        cotangent = random.uniform(-1, 1, (18, 24))
        direction = random.uniform(-1, 1, self.vertices.shape)

        def along(step):
            flux = lensforge.flux_image(
                self.vertices + step * direction, self.faces, setup, model)
            return float((flux * cotangent).sum())

        bar = lensforge.flux_image_vjp(self.vertices, self.faces, setup, cotangent, model)
        self.assertEqual((bar.dtype, bar.shape), (np.float64, self.vertices.shape))
        step = 1e-6
        near, far = along(step) - along(-step), along(2 * step) - along(-2 * step)
        slope = (8 * near - far) / (12 * step)
        products = bar * direction
        return abs(slope - products.sum()) / max(abs(products.sum()), np.linalg.norm(products))

    def test_product_equals_finite_differences(self):
        lights = {
            "parallel": {},
            "point": {"source": "point", "source_position": (10.0, 8.0, -120.0)},
            "mirror": {"mode": "reflect", "incidence": 20.0},
            "losses": {"fresnel": True},
        }
        for name, light in lights.items():
            setup = lensforge.Setup(24, 18, width=20.0, focal=80.0, **light)
            for model in ("facet", "smooth"):
                with self.subTest(light=name, model=model):
                    self.assertLess(self.slope_error(setup, model), 1e-5)

    def test_descending_along_the_product_lowers_the_error(self):
        wanted = lensforge.flux_image(self.vertices, self.faces, self.setup)
        flat = self.vertices.copy()
        flat[:, 2] = 5.0
        flux = lensforge.flux_image(flat, self.faces, self.setup)
        bar = lensforge.flux_image_vjp(flat, self.faces, self.setup, 2 * (flux - wanted))
        bar[:, :2] = 0.0
        moved = flat - 1e-3 * bar / np.abs(bar).max()
        after = lensforge.flux_image(moved, self.faces, self.setup)
        self.assertLess(((after - wanted) ** 2).sum(), ((flux - wanted) ** 2).sum())


if __name__ == "__main__":
    unittest.main()
