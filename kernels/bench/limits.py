"""What the machine itself can do: bytes copied in a second."""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor

import numpy as np

COPIED = 256 * 2**20


def cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0))


class Copy:
    """A copy of 256 MiB by some threads, beyond any cache; call it to copy once."""

    def __init__(self, threads: int) -> None:
        source, target = np.ones(COPIED, np.uint8), np.zeros(COPIED, np.uint8)
        self._parts = list(zip(np.array_split(target, threads), np.array_split(source, threads), strict=True))
        self._threads = ThreadPoolExecutor(threads)

    def __call__(self) -> None:
        """Copy once."""
        for done in [self._threads.submit(np.copyto, to, source) for to, source in self._parts]:
            done.result()

    @staticmethod
    def seconds_for(moved: int, copy_s: float) -> float:
        """Least time for that many bytes, read and written together, when one copy takes `copy_s`."""
        return moved * copy_s / (2 * COPIED)
