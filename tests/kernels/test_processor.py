"""Every hot loop has a version for each kind of processor, and PBRDF_ISA pins all of them."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from pbrdf._kernels import processor

VERSIONS = [version for version in ("v2", "v3", "v4") if version <= processor.isa()]

RESULTS = """
import sys, numpy as np
from pbrdf._kernels import physicality, decomposition, processor
random = np.random.default_rng(5)
elements = random.normal(0, 0.2, (203, 4, 4))
elements[:, 0, 0] = 1.0
results = {}
for dtype in (np.float32, np.float64):
    m = elements.astype(dtype)
    values, nearest = np.empty((203, 4), dtype), np.empty_like(m)
    physicality.coherency_eigenvalues(m, values)
    physicality.nearest_physical(m, nearest)
    factors, guard = [np.empty_like(m) for _ in range(3)], np.empty(203, np.uint8)
    decomposition.lu_chipman(m, *factors, guard)
    name = np.dtype(dtype).name
    results |= {f"values_{name}": values, f"nearest_{name}": nearest, f"diattenuator_{name}": factors[2]}
np.savez(sys.argv[1], isa=processor.isa(), **results)
"""


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> dict[str, dict[str, np.ndarray]]:
    folder = tmp_path_factory.mktemp("versions")
    for version in VERSIONS:
        subprocess.run(
            [sys.executable, "-c", RESULTS, str(folder / version)],
            env=os.environ | {"PBRDF_ISA": version},
            check=True,
        )
    return {version: dict(np.load(folder / f"{version}.npz")) for version in VERSIONS}


def test_the_pinned_version_is_the_one_that_runs(results: dict[str, dict[str, np.ndarray]]) -> None:
    assert {version: str(result.pop("isa")) for version, result in results.items()} == {
        v: v for v in VERSIONS
    }


def test_versions_agree_to_rounding(results: dict[str, dict[str, np.ndarray]]) -> None:
    best = results[VERSIONS[-1]]
    for result in results.values():
        for name in best.keys() - {"isa"}:
            rounding = 100 * np.finfo(best[name].dtype).eps
            np.testing.assert_allclose(
                result[name], best[name], rtol=0, atol=rounding * np.nanmax(np.abs(best[name]))
            )


@pytest.mark.skipif(len(VERSIONS) < 2, reason="this processor has one version alone")
def test_versions_differ_in_the_last_bits(results: dict[str, dict[str, np.ndarray]]) -> None:
    """Fused multiply-adds come with v3: equal bits would mean that nothing was pinned."""
    name = "nearest_float32"
    assert not np.array_equal(results["v2"][name], results[VERSIONS[-1]][name])


def test_a_version_that_is_none_is_refused(tmp_path: Path) -> None:
    run = subprocess.run(
        [sys.executable, "-c", RESULTS, str(tmp_path / "none")],
        env=os.environ | {"PBRDF_ISA": "v9"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert run.returncode != 0
    assert "PBRDF_ISA is v9; this processor has v2 to" in run.stderr
