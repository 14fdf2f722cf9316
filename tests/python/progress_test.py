# SPDX-License-Identifier: GPL-3.0-or-later
"""Long work tells its progress to a function, a bar or stderr, and what the function raises ends it."""

import contextlib
import io
import sys
import tempfile
import time
import types
import unittest
from pathlib import Path
from unittest import mock

import numpy as np

import lensforge
import small_lens

STOP_BOUND = 10.0  # s, as in interrupt_test.py


class FakeBar:
    """Stands for tqdm's."""

    made = []

    def __init__(self, desc, total, file, bar_format):
        self.desc, self.total, self.n, self.shown, self.closed = desc, total, 0, [], False
        bar_format.format(desc=desc, percentage=1.0, bar="", elapsed="", remaining="")
        FakeBar.made.append(self)

    def refresh(self):
        self.shown.append((self.n, self.total))

    def close(self):
        self.closed = True


def small_design(**more):
    return lensforge.design(small_lens.PICTURE, **small_lens.OPTIONS, **more)


class Progress(unittest.TestCase):
    def test_a_function_hears_of_the_stages(self):
        heard, times = [], []

        def told(stage, done, total):
            times.append(time.monotonic())
            heard.append((stage, done, total))

        lens = lensforge.design(np.ones((64, 64), np.float32), rounds=2, quality="draft", progress=told)
        self.assertEqual(lens.target.shape, (64, 64))
        self.assertGreater(len(heard), 1)
        for stage, done, total in heard:
            self.assertIsInstance(stage, str)
            self.assertGreaterEqual(done, 0.0)
            self.assertTrue(total == 0.0 or done <= total, (stage, done, total))
        self.assertEqual(heard[-1][1], heard[-1][2])
        gaps = np.diff(times[:-1])  # The last call comes when the work is done.
        self.assertTrue((gaps > 0.09).all(), gaps)

    def test_what_the_function_raises_stops_the_work_and_reaches_the_caller(self):
        class Enough(Exception):
            pass

        raised = []

        def told(stage, done, total):
            raised.append(time.monotonic())
            raise Enough(stage)

        random = np.random.default_rng(3)
        with self.assertRaises(Enough):
            lensforge.design(random.random((256, 256), np.float32), rounds=1000, quality="paper",
                             progress=told)
        self.assertLess(time.monotonic() - raised[0], STOP_BOUND)
        self.assertEqual(len(raised), 1)

    def test_other_functions_tell_theirs(self):
        with tempfile.TemporaryDirectory() as place:
            lens = small_design()
            lens.save(Path(place) / "lens")
            calls = {
                "cam": lambda told: lensforge.cam(lens, pitch=0.3, sample_spacing=0.03, progress=told),
                "export": lambda told: lensforge.export(lens, Path(place) / "a.step", progress=told),
                "view": lambda told: lensforge.view(lens, Path(place) / "a.html", progress=told),
            }
            for name, call in calls.items():
                heard = []
                call(lambda *report: heard.append(report))
                self.assertGreater(len(heard), 0, name)
                self.assertTrue(all(len(report) == 3 for report in heard), name)

    def test_true_prints_lines_without_tqdm(self):
        printed = io.StringIO()
        with mock.patch.dict(sys.modules, {"tqdm": None}), contextlib.redirect_stderr(printed):
            small_design(progress=True)
        self.assertRegex(printed.getvalue(), r"(?m)^\S.*\d %$")

    def test_true_shows_a_bar_with_tqdm(self):
        FakeBar.made = []
        with mock.patch.dict(sys.modules, {"tqdm": types.SimpleNamespace(tqdm=FakeBar)}):
            small_design(progress=True)
        self.assertGreater(len(FakeBar.made), 0)
        for bar in FakeBar.made:
            self.assertTrue(bar.closed)
            self.assertGreater(len(bar.shown), 0)

    def test_false_and_none_say_nothing(self):
        printed = io.StringIO()
        with contextlib.redirect_stderr(printed):
            small_design(progress=False)
            small_design(progress=None)
        self.assertEqual(printed.getvalue(), "")


if __name__ == "__main__":
    unittest.main()
