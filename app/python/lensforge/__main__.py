# SPDX-License-Identifier: GPL-3.0-or-later
"""The command lensforge: python3 -m lensforge design photo.jpg --out lens."""

import os
import sys

if not __package__:  # Run by the folder's path, which is not where packages are found.
    sys.path[0] = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))

from lensforge import _lensforge  # noqa: E402

sys.exit(_lensforge.run_command_line([os.fsencode(word) for word in sys.argv]))
