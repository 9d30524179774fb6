"""Chance of a virtual rig: numbers that depend on names alone."""

from __future__ import annotations

import hashlib

import numpy as np
from numpy.typing import NDArray


def random_word(name: str) -> int:
    """64 bits that depend on a name alone."""
    return int.from_bytes(hashlib.blake2b(name.encode(), digest_size=8).digest(), "little")


def drawn(name: str, count: int) -> NDArray[np.float64]:
    """Numbers (count,) in [0, 1), evenly distributed, that depend on a name alone; `count` is at most 8."""
    words = hashlib.blake2b(name.encode(), digest_size=8 * count).digest()
    # NumPy promises no sequence of its own generators for ever
    whole = np.frombuffer(words, "<u8") >> np.uint64(11)
    return whole.astype(np.float64) * 2.0**-53
