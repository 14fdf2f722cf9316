# SPDX-License-Identifier: GPL-3.0-or-later
"""Moves a lens's heights down the gradient of its picture's error: a loop to which you can add terms."""

import sys

import numpy as np

import lensforge

lens = lensforge.Lens(sys.argv[1])
wanted = lens.target / lens.target.sum()
vertices = lens.vertices.copy()


def error_and_slope():
    """Squared error of the flux, in units of an evenly lit pixel's, and its gradient by z."""
    flux = lensforge.flux_image(vertices, lens.faces, lens.setup)
    miss = (flux - wanted) * flux.size
    bar = lensforge.flux_image_vjp(vertices, lens.faces, lens.setup, 2 * miss)
    return (miss**2).mean(), bar[:, 2]


step = 1e-6  # mm
error, slope = error_and_slope()
for _ in range(30):
    print(f"error {error:.6f}")
    vertices[:, 2] -= step * slope / np.abs(slope).max()
    before, (error, slope) = error, error_and_slope()
    step *= 1.2 if error < before else 0.3
