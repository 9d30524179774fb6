"""What the machine itself can do: bytes copied and multiply-adds done in a second."""

from __future__ import annotations

import ctypes
import os
import subprocess
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
from pbrdf._kernels import planes

COPIED = 256 * 2**20
FMA_ROUNDS = 2_000_000


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


class MultiplyAdd:
    """Rounds of float32 multiply-adds by some threads, in the kernels' instruction set; call it to run once.

    Needs the compiler that the kernels were built with, as ``c++``.
    """

    def __init__(self, threads: int) -> None:
        with tempfile.TemporaryDirectory() as folder:
            library = Path(folder) / "fma_rate.so"
            source = Path(__file__).with_name("fma_rate.cpp")
            flags = ["-O3", f"-march=x86-64-{planes.isa()}", "-shared", "-fPIC"]
            subprocess.run(["c++", *flags, str(source), "-o", str(library)], check=True)
            self._run = ctypes.CDLL(str(library)).fma_rate
        self._run.restype, self._run.argtypes = ctypes.c_double, [ctypes.c_long]
        self._pool = ThreadPoolExecutor(threads)
        self._threads = threads
        self.best_rate = 0.0

    def __call__(self) -> None:
        """Run once; `best_rate` is the most that all threads together ever did in a second."""
        jobs = [self._pool.submit(self._run, FMA_ROUNDS) for _ in range(self._threads)]
        self.best_rate = max(self.best_rate, sum(float(job.result()) for job in jobs))
