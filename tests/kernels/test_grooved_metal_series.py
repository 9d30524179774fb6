"""The series behind the weight of Hyde's diffuse term is what its tool makes."""

from __future__ import annotations

import re
import runpy
from pathlib import Path

import numpy as np

TOOL = runpy.run_path(str(Path(__file__).resolve().parents[2] / "tools/grooved_metal.py"))
COEFFICIENT = re.compile(r"-?\d\.\d{10}e[+-]\d{2}")


def test_the_header_is_what_its_tool_writes() -> None:
    kept, made = TOOL["HEADER"].read_text(encoding="utf-8"), TOOL["header"]()
    assert COEFFICIENT.sub("", kept) == COEFFICIENT.sub("", made)
    kept, made = (np.array(COEFFICIENT.findall(text), np.float64) for text in (kept, made))
    # the last digits of an integral depend on how a processor sums
    np.testing.assert_allclose(kept, made, rtol=1e-9, atol=1e-13)
