# SPDX-License-Identifier: GPL-3.0-or-later
"""The words that start the command in a process of its own: this Python and the package's folder."""

import os
import sys

WORDS = [sys.executable, os.path.dirname(os.path.abspath(__file__))]
