"""What the machine itself can do: bytes copied and multiply-adds done in a second."""

from __future__ import annotations

import ctypes
import os
import subprocess
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
from pbrdf._kernels import processor

COPIED = 256 * 2**20
FMA_ROUNDS = 2_000_000
LINE = 64


def cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0))


def compiled(name: str) -> ctypes.CDLL:
    """Library of a C++ file beside this one, in the kernels' instruction set.

    Needs the compiler that the kernels were built with, as ``c++``.
    """
    with tempfile.TemporaryDirectory() as folder:
        library = Path(folder) / f"{name}.so"
        source = Path(__file__).with_name(f"{name}.cpp")
        flags = ["-O3", f"-march=x86-64-{processor.isa()}", "-shared", "-fPIC"]
        subprocess.run(["c++", *flags, str(source), "-o", str(library)], check=True)
        return ctypes.CDLL(str(library))


class Copy:
    """A copy of 256 MiB by some threads, beyond any cache and past it; call it to copy once."""

    def __init__(self, threads: int) -> None:
        self._arrays = [np.ones(COPIED + LINE, np.uint8) for _ in range(2)]
        self._places = [array.ctypes.data + -array.ctypes.data % LINE for array in self._arrays]
        self._copy = compiled("stream_copy").stream_copy
        self._copy.argtypes = [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_size_t]
        self._threads = ThreadPoolExecutor(threads)
        self._part = COPIED // threads // LINE * LINE
        self._offsets = [part * self._part for part in range(threads)]

    def __call__(self) -> None:
        """Copy once."""
        to, source = self._places
        parts = [(to + offset, source + offset, self._part) for offset in self._offsets]
        for done in [self._threads.submit(self._copy, *part) for part in parts]:
            done.result()

    @staticmethod
    def seconds_for(moved: int, copy_s: float) -> float:
        """Least time for that many bytes, read and written together, when one copy takes `copy_s`."""
        return moved * copy_s / (2 * COPIED)


class MultiplyAdd:
    """Rounds of float32 multiply-adds by some threads, in the kernels' instruction set; call to run once."""

    def __init__(self, threads: int) -> None:
        self._run = compiled("fma_rate").fma_rate
        self._run.restype, self._run.argtypes = ctypes.c_double, [ctypes.c_long]
        self._pool = ThreadPoolExecutor(threads)
        self._threads = threads
        self.best_rate = 0.0

    def __call__(self) -> None:
        """Run once; `best_rate` is the most that all threads together ever did in a second."""
        jobs = [self._pool.submit(self._run, FMA_ROUNDS) for _ in range(self._threads)]
        self.best_rate = max(self.best_rate, sum(float(job.result()) for job in jobs))
