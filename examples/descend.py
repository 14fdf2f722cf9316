# SPDX-License-Identifier: GPL-3.0-or-later
"""Moves a lens's heights down the gradient of its picture's error: a loop to which you can add terms.

descend.py [DIR]: the lens in a folder; without one, a lens for a small picture that is drawn here.
"""

import sys

import numpy as np

import lensforge


def drawn_lens():
    """A ring on grey, quickly designed."""
    x, y = np.meshgrid(np.linspace(-1, 1, 32), np.linspace(-1, 1, 32))
    picture = 0.3 + 0.7 * (abs(np.hypot(x, y) - 0.6) < 0.2)
    return lensforge.design(picture, width=12, focal=60, rounds=1, quality="draft")


def error_and_slope():
    """Squared error of the flux, in units of an evenly lit pixel's, and its gradient by z."""
    flux = lensforge.flux_image(vertices, lens.faces, lens.setup)
    miss = (flux - wanted) * flux.size
    bar = lensforge.flux_image_vjp(vertices, lens.faces, lens.setup, 2 * miss)
    return (miss**2).mean(), bar[:, 2]


lens = lensforge.Lens(sys.argv[1]) if len(sys.argv) > 1 else drawn_lens()
wanted = lens.target / lens.target.sum()
vertices = lens.vertices.copy()
step = 1e-6  # mm
error, slope = error_and_slope()
for _ in range(30):
    print(f"error {error:.6f}")
    vertices[:, 2] -= step * slope / np.abs(slope).max()
    before, (error, slope) = error, error_and_slope()
    step *= 1.2 if error < before else 0.3
