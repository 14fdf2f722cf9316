# SPDX-License-Identifier: GPL-3.0-or-later
"""From a picture to the milled lens that projects it."""

from ._errors import InputError, MissingFileError, RunError
from ._functions import (
    ThreeLenses,
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
    three_lamps,
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
    "ThreeLenses",
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
    "three_lamps",
    "view",
]

# Where they are imported from, for messages and pickles.
for _name in __all__:
    if _name != "__version__":
        globals()[_name].__module__ = __name__
