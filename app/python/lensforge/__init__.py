# SPDX-License-Identifier: GPL-3.0-or-later
"""From a picture to the milled lens that projects it."""

from ._lensforge import (
    InputError,
    Lens,
    RunError,
    Setup,
    __version__,
    cam,
    design,
    export,
    flux_image,
    flux_image_vjp,
    render,
)

__all__ = [
    "InputError",
    "Lens",
    "RunError",
    "Setup",
    "__version__",
    "cam",
    "design",
    "export",
    "flux_image",
    "flux_image_vjp",
    "render",
]
