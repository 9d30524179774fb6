from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pbrdf.errors import InputError
from pbrdf.formats.axes_file import read_axes


def _written(folder: Path, text: str) -> Path:
    path = folder / "axes.yaml"
    path.write_text(text)
    return path


def test_degrees_become_radians(tmp_path: Path) -> None:
    axes = read_axes(_written(tmp_path, "theta_h_deg: [0, 45, 90]\nphi_d_deg: [-180.0, 180]\n"))
    assert axes.keys() == {"theta_h", "phi_d"}
    assert axes["theta_h"] == pytest.approx([0, np.pi / 4, np.pi / 2])
    assert axes["phi_d"] == pytest.approx([-np.pi, np.pi])


@pytest.mark.parametrize(
    ("text", "field"),
    [
        ("theta_h: [0, 1]", "theta_h"),
        ("theta_h_deg: 3", "theta_h_deg"),
        ("theta_h_deg: [0, true]", "theta_h_deg"),
        ("theta_h_deg: [0, a]", "theta_h_deg"),
        ("theta_h_deg: []", "theta_h_deg"),
        ("theta_h_deg: [1, 0]", "theta_h_deg"),
        ("theta_h_deg: [0, .nan]", "theta_h_deg"),
        ("theta_h_deg: [0, 91]", "theta_h_deg"),
        ("phi_d_deg: [-181, 0]", "phi_d_deg"),
        ("theta_h_deg: [0, 1", "file"),
        ("- 1", "file"),
        ("", "file"),
    ],
)
def test_what_is_no_axis_is_refused(tmp_path: Path, text: str, field: str) -> None:
    path = _written(tmp_path, text)
    with pytest.raises(InputError) as refused:
        read_axes(path)
    assert refused.value.field == field
    assert refused.value.source == str(path)
    assert "\n" not in str(refused.value)


def test_a_missing_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"axes\.yaml"):
        read_axes(tmp_path / "axes.yaml")
