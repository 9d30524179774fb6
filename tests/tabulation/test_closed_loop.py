"""What the comparison with the truth counts, writes and says."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pbrdf.errors import InputError
from pbrdf.tabulation.closed_loop import Agreement, ClosedLoop, in_words, random_bins


def agreement(seed: int = 1) -> Agreement:
    truth = np.zeros((200, 4, 4))
    truth[:, 0, 0] = 2.0
    found = truth + np.random.default_rng(seed).normal(0.0, 0.01, truth.shape)
    found[:50] = 0.0
    return Agreement.of(found, truth)


def test_errors_are_of_the_true_m00_where_the_table_tells_anything() -> None:
    found = agreement()
    assert found.covered == 0.75
    # of 16 Gaussian errors of 0.005 the largest is about two standard deviations
    assert 0.009 < found.median < 0.013 < found.p90
    assert found.element_median.max() < found.median


def test_one_wrong_element_is_seen_in_its_place() -> None:
    truth = np.broadcast_to(np.eye(4), (100, 4, 4))
    found = truth.copy()
    found[:, 3, 2] = -0.2
    agreement = Agreement.of(found, truth)
    assert agreement.median == pytest.approx(0.2)
    assert np.argmax(agreement.element_median) == 14
    assert np.count_nonzero(agreement.element_p90) == 1


def test_a_table_that_tells_nothing_agrees_in_nothing() -> None:
    nothing = Agreement.of(np.zeros((5, 4, 4)), np.ones((5, 4, 4)))
    assert (nothing.covered, nothing.median, nothing.p90) == (0.0, 1.0, 1.0)


def test_what_is_written_is_read(tmp_path: Path) -> None:
    bands = {nm: {"measured": agreement(nm), "filled": agreement(nm + 1)} for nm in (450, 550)}
    ClosedLoop("jade", "a stone", 200, bands).write(tmp_path / "a.json", {"measured": "0"})
    found = ClosedLoop.read(tmp_path / "a.json")
    assert (found.material, found.truth, found.directions) == ("jade", "a stone", 200)
    for nm, exports in bands.items():
        for export, each in exports.items():
            again = found.bands[nm][export]
            assert again.plain() == each.plain()


def test_a_document_without_a_figure_is_refused(tmp_path: Path) -> None:
    bands = {450: {"measured": agreement()}}
    ClosedLoop("jade", "a stone", 200, bands).write(tmp_path / "a.json", {})
    with pytest.raises(InputError) as refused:
        ClosedLoop.read(tmp_path / "a.json")
    assert refused.value.field.startswith("bands_nm.450.filled")


def test_random_places_stand_above_the_horizon_and_off_the_pole() -> None:
    theta_h, theta_d, phi_d = random_bins(20_000, 5)
    assert 12_000 < len(theta_h) < 12_500
    assert theta_d.min() > np.radians(3)
    assert np.abs(phi_d).max() <= np.pi
    assert np.median(theta_h) < np.radians(20)


@pytest.mark.parametrize(
    ("sphere", "words"),
    [
        ({"table": "there/a.pbsdf"}, "table a.pbsdf"),
        ({"mitsuba": {"type": "pplastic", "alpha": 0.1}}, "Mitsuba's pplastic, alpha 0.1"),
        ({"mitsuba": {"450": {"type": "diffuse"}}}, "Mitsuba's diffuse"),
        (
            {"mitsuba": {"type": "measured_polarized", "filename": "a/b.pbsdf"}},
            "Mitsuba's measured_polarized, filename b.pbsdf",
        ),
        ({"model": "baek2018", "roughness": 0.2}, "baek2018, roughness 0.2"),
    ],
)
def test_spheres_are_told_in_words(sphere: dict[str, object], words: str) -> None:
    assert in_words(sphere) == words
