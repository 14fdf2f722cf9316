# SPDX-License-Identifier: GPL-3.0-or-later
"""Ctrl-C ends long work, and other threads run while it goes on."""

import os
import signal
import threading
import time
import unittest

import numpy as np

import lensforge

# Idle cores take well below a second; this only tells a stop from work that was waited for.
STOP_BOUND = 10.0


def long_design():
    random = np.random.default_rng(3)
    lensforge.design(random.random((256, 256), np.float32), rounds=1000, quality="paper")


class Interrupt(unittest.TestCase):
    def test_ctrl_c_ends_a_design(self):
        sent = []

        def interrupt():
            sent.append(time.monotonic())
            os.kill(os.getpid(), signal.SIGINT)

        timer = threading.Timer(3.0, interrupt)
        timer.start()
        with self.assertRaises(KeyboardInterrupt):
            long_design()
        self.assertLess(time.monotonic() - sent[0], STOP_BOUND)
        print(f"stopped {time.monotonic() - sent[0]:.2f} s after Ctrl-C")

    def test_other_threads_run_while_a_design_does(self):
        counted = [0]
        done = threading.Event()

        def count():
            while not done.wait(0.01):
                counted[0] += 1

        counter = threading.Thread(target=count)
        counter.start()
        lensforge.design(np.ones((64, 64), np.float32), rounds=1, quality="draft")
        done.set()
        counter.join()
        self.assertGreater(counted[0], 5)


if __name__ == "__main__":
    unittest.main()
