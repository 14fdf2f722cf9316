# SPDX-License-Identifier: GPL-3.0-or-later
"""From a picture to the milled lens that projects it."""

from ._errors import InputError, MissingFileError, RunError
from ._functions import (
    batch,
    cam,
    check,
    coupon,
    design,
    export,
    info,
    nest,
    plan,
    reflect,
    render,
    view,
)
from ._lens import Lens, Setup, flux_image, flux_image_vjp
from ._lensforge import __version__

__all__ = [
    "InputError",
    "Lens",
    "MissingFileError",
    "RunError",
    "Setup",
    "__version__",
    "batch",
    "cam",
    "check",
    "coupon",
    "design",
    "export",
    "flux_image",
    "flux_image_vjp",
    "info",
    "nest",
    "plan",
    "reflect",
    "render",
    "view",
]

# Where they are imported from, for messages and pickles.
for _name in __all__:
    if _name != "__version__":
        globals()[_name].__module__ = __name__
