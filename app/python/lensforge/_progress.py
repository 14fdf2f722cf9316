# SPDX-License-Identifier: GPL-3.0-or-later
"""Progress of long work: a function of the caller's, a bar by tqdm, or lines on stderr."""

import contextlib
import sys
import time

LINE_INTERVAL = 5.0  # s


class _Bar:
    """A bar for every stage."""

    def __init__(self, tqdm):
        self._tqdm = tqdm
        self._stage = None
        self._bar = None

    def show(self, stage, done, total):
        if stage != self._stage:
            self.close()
            self._stage = stage
            self._bar = self._tqdm(
                desc=stage, total=total or None, file=sys.stderr,
                bar_format="{desc}: {percentage:3.0f} %|{bar}| {elapsed}<{remaining}")
        self._bar.total = total or None
        self._bar.n = done
        self._bar.refresh()

    def close(self):
        if self._bar is not None:
            self._bar.close()


class _Lines:
    """A line for every stage, and one every few seconds."""

    def __init__(self):
        self._stage = None
        self._next = 0.0

    def show(self, stage, done, total):
        now = time.monotonic()
        if stage == self._stage and now < self._next:
            return
        self._stage = stage
        self._next = now + LINE_INTERVAL
        share = f": {100 * done / total:.0f} %" if total > 0 else ""
        print(f"{stage}{share}", file=sys.stderr, flush=True)

    def close(self):
        pass


def _display():
    try:
        from tqdm import tqdm
    except ImportError:
        return _Lines()
    return _Bar(tqdm)


@contextlib.contextmanager
def function_of(progress):
    """The function to call for a function's `progress` argument, or None."""
    if progress is None or progress is False:
        yield None
    elif progress is True:
        display = _display()
        try:
            yield display.show
        finally:
            display.close()
    elif callable(progress):
        yield progress
    else:
        raise TypeError(f"progress={progress!r}: must be True or a function of stage, done and total")
