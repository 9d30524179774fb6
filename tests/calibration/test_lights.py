"""``lights.json``: what is written is read, and what must not be used is refused."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from pbrdf.calibration.arm_fit import ArmFit
from pbrdf.calibration.lights import KIND, read_lights
from pbrdf.calibration.measured_lights import measured_lights
from pbrdf.errors import InputError
from pbrdf.formats.documents import write_document

FIT = ArmFit(
    centre_mm=(6.0, -4.0, 1004.0),
    axis=(0.0, -1.0, 0.0),
    start=(0.0, 0.0, -1.0),
    radius_mm=800.0,
    offsets_mm={41.0: (0.5, -1.5, 0.25)},
    centre_errors_mm=(0.1, 0.1, 0.2),
    axis_error_deg=0.01,
    start_error_deg=0.02,
    radius_error_mm=1.5,
    direction_errors_deg={41.0: 0.03, 43.0: 0.01},
    residuals_px={41.0: [(0.01, -0.02)], 43.0: [(0.1, 0.05), (-0.1, 0.2)]},
    usable=True,
    verdict="usable: light directions to 0.03°",
    notes=("A ball in one place tells rays.",),
)


def test_what_is_written_is_read(tmp_path: Path) -> None:
    path = tmp_path / "lights.json"
    write_document(path, KIND, measured_lights(FIT, (0.0, -1.0, 0.0)))
    arm = read_lights(path)
    assert (arm.centre_mm, arm.axis, arm.start, arm.radius_mm) == (
        FIT.centre_mm,
        FIT.axis,
        FIT.start,
        FIT.radius_mm,
    )
    assert arm.generator_axis == (0.0, -1.0, 0.0)
    np.testing.assert_allclose(arm.light_position(0.0), [6.0, -4.0, 204.0])
    bare = np.array([6.0, -4.0, 1004.0]) + 800 * np.array(
        [np.sin(np.deg2rad(41)), 0, -np.cos(np.deg2rad(41))]
    )
    np.testing.assert_allclose(arm.light_position(41.0) - bare, FIT.offsets_mm[41.0], atol=1e-9)
    content = json.loads(path.read_text())
    assert content["standard_errors"]["direction_deg"] == {"041.00": 0.03, "043.00": 0.01}
    assert content["residuals_px"]["043.00"] == [[0.1, 0.05], [-0.1, 0.2]]


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"verdict": "unusable: the distance is open"}, "verdict"),
        ({"offsets_mm": [1, 2, 3]}, "offsets_mm"),
        ({"offsets_mm": {"left": [0, 0, 0]}}, "offsets_mm.left"),
        ({"offsets_mm": {"nan": [0, 0, 0]}}, "offsets_mm.nan"),
        ({"offsets_mm": {"041.00": [0, 0]}}, "041.00"),
        ({"radius_mm": 0}, "radius_mm"),
    ],
)
def test_what_must_not_be_used_is_refused(tmp_path: Path, change: dict[str, object], field: str) -> None:
    path = tmp_path / "lights.json"
    write_document(path, KIND, measured_lights(FIT, (0.0, -1.0, 0.0)) | change)
    with pytest.raises(InputError) as caught:
        read_lights(path)
    assert field in caught.value.field
