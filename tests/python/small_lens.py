# SPDX-License-Identifier: GPL-3.0-or-later
"""A lens of 24 x 24 pixels that the tests share, designed once in a process."""

import functools
import os
from pathlib import Path

import lensforge

PICTURE = Path(os.environ["LENSFORGE_PICTURES"]) / "rings.png"
OPTIONS = {"pixels": 24, "width": 12.0, "focal": 60.0, "rounds": 1, "quality": "draft", "threads": 2}


@functools.cache
def lens() -> lensforge.Lens:
    return lensforge.design(PICTURE, **OPTIONS)
