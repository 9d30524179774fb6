"""What a job needs of a machine: memory, disk, time and threads, from how much there is to do.

Each line is a fit to measured jobs (docs/scaling.md) with a margin: a cluster ends a job that takes more
memory than it asked for, and processors differ.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

from pbrdf.settings.room import COMPRESSED

LARGE_PIXELS = 1 << 20
"""Frames from which on a job is given two threads: smaller ones spend their time elsewhere."""

MEMORY_MARGIN, TIME_MARGIN, LEAST_MINUTES = 1.25, 3.0, 5


@dataclass(frozen=True)
class Problem:
    """How much there is to do for a material.

    Attributes
    ----------
    lights, bands, states, exposures : int
    frames_per_light : int
        Repeats and dark frames included.
    pixels : int
        Of a frame.
    word_bytes : int
        Of a pixel.
    nodes : tuple of int
        Of the table: θh, θd, φd.
    fitted_share : float
        Nodes that a fit looks at over all nodes.
    fits : int
        How often it does, starts and held-out slabs.
    """

    lights: int
    bands: int
    states: int
    exposures: int
    frames_per_light: int
    pixels: int
    word_bytes: int
    nodes: tuple[int, int, int]
    fitted_share: float
    fits: int

    @property
    def light_bytes(self) -> float:
        """Photographs of a light, on the disk."""
        return COMPRESSED * self.frames_per_light * self.pixels * self.word_bytes

    @property
    def slab(self) -> int:
        """Nodes of a slice, in one band."""
        return self.nodes[0] * self.nodes[2]

    @property
    def band(self) -> int:
        """Nodes of a table, in one band."""
        return math.prod(self.nodes)

    @property
    def table(self) -> int:
        """Nodes of a table."""
        return self.bands * self.band


class Needs(NamedTuple):
    """What a job asks for, by Snakemake's names of it; `runtime` in minutes."""

    mem_mb: int
    disk_mb: int
    runtime: int
    threads: int


class _Measured(NamedTuple):
    """Bytes of memory beside the programs, bytes that stay on the disk, seconds of one processor."""

    memory: float
    disk: float
    seconds: float


PROGRAMS_MB = 270
"""Python with its packages; one that also draws has 150 MB more."""

NODE_BYTES = 4 * 16 + 4 * 16 + 3
"""Matrix, variances, count and origin of a node."""


def _photograph(p: Problem) -> _Measured:
    return _Measured(240.0 * p.pixels, p.lights * p.light_bytes, p.lights * p.frames_per_light * 1.0)


def _import_images(p: Problem) -> _Measured:
    raw = p.frames_per_light * p.pixels * p.word_bytes
    return _Measured(2.5 * raw, p.light_bytes, 5.0 + 1e-7 * raw)


def _reconstruct(p: Problem) -> _Measured:
    # rates or elements with variances, exposures used, raw frames twice, and what is written
    pixel = 4 * max(p.states, 34) + p.states + 6 * p.exposures * p.word_bytes + 80
    frames = p.frames_per_light * p.pixels
    return _Measured(pixel * p.pixels, 104.0 * p.bands * p.pixels, 5.0 + 1e-8 * frames)


def _slice(p: Problem) -> _Measured:
    nodes = p.bands * p.slab
    return _Measured(
        240.0 * p.pixels + 400.0 * nodes, NODE_BYTES * nodes + 8.0 * p.slab, 5.0 + 3e-7 * p.bands * p.pixels
    )


def _tabulate(p: Problem) -> _Measured:
    return _Measured(340.0 * p.band, NODE_BYTES * p.table, 5.0 + 2e-6 * p.table)


def _import_table(p: Problem) -> _Measured:
    return _Measured(320.0 * p.table, NODE_BYTES * p.table, 5.0 + 2e-6 * p.table)


def _export(p: Problem) -> _Measured:
    return _Measured(160.0 * p.table, 128.0 * p.table, 5.0 + 1e-6 * p.table)


def _fit(p: Problem) -> _Measured:
    fitted = p.fitted_share * p.table
    return _Measured(NODE_BYTES * p.table + 300.0 * fitted, 1e5, 10.0 + 5e-5 * p.fits * fitted)


def _calibrate(p: Problem) -> _Measured:
    return _Measured(60e6 + 240.0 * p.pixels, 1e6 + 4.0 * p.bands * p.pixels, 60.0 + 1e-5 * p.pixels)


def _page(p: Problem) -> _Measured:
    return _Measured(150e6 + 1.3 * NODE_BYTES * p.table, 2e7, 20.0 + 5e-6 * p.table)


STEPS: dict[str, Callable[[Problem], _Measured]] = {
    "photograph": _photograph,
    "import_images": _import_images,
    "reconstruct": _reconstruct,
    "slice": _slice,
    "tabulate": _tabulate,
    "import_table": _import_table,
    "export": _export,
    "fit": _fit,
    "calibrate": _calibrate,
    "page": _page,
}
_BY_PIXELS = ("reconstruct", "slice")


def needs(step: str, problem: Problem) -> Needs:
    """What a job of a step asks for; the step is a key of `STEPS`."""
    measured = STEPS[step](problem)
    return Needs(
        mem_mb=math.ceil(MEMORY_MARGIN * (PROGRAMS_MB + measured.memory / 1e6)),
        disk_mb=math.ceil(measured.disk / 1e6),
        runtime=max(LEAST_MINUTES, math.ceil(TIME_MARGIN * measured.seconds / 60)),
        threads=2 if step in _BY_PIXELS and problem.pixels > LARGE_PIXELS else 1,
    )
