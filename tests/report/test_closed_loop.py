"""The page of the closed loop: every figure stands there, and nothing of a name is taken for HTML."""

from __future__ import annotations

import re

import numpy as np

from pbrdf.report.closed_loop import closed_loop_page
from pbrdf.tabulation.closed_loop import Agreement, ClosedLoop

HOSTILE = '<script>alert("x")</script>'


def loop() -> ClosedLoop:
    random = np.random.default_rng(3)

    def agreement() -> Agreement:
        covered, median, p90 = (float(value) for value in random.uniform(0.001, 1.0, 3))
        return Agreement(covered, median, p90, random.uniform(size=(4, 4)), random.uniform(size=(4, 4)))

    bands = {nm: {"measured": agreement(), "filled": agreement()} for nm in (450, 550, 650)}
    return ClosedLoop(HOSTILE, HOSTILE, 12_181, bands)


def test_every_figure_stands_there() -> None:
    page = closed_loop_page([loop()], {"from": HOSTILE})
    shown = {float(value) for value in re.findall(r'<data value="([^"]*)"', page)}
    for exports in loop().bands.values():
        for each in exports.values():
            assert {each.covered, each.median, each.p90} <= shown
    over_bands = np.median([bands["measured"].element_median for bands in loop().bands.values()], axis=0)
    assert set(over_bands.ravel().tolist()) <= shown


def test_names_are_text_and_the_bytes_the_same() -> None:
    page = closed_loop_page([loop()], {"from": HOSTILE})
    assert HOSTILE not in page
    assert page == closed_loop_page([loop()], {"from": HOSTILE})
