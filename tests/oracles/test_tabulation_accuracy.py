"""What tabulation by itself costs, on photographs of Mitsuba's materials without noise."""

from __future__ import annotations

import pytest

pytest.importorskip("mitsuba", reason="Mitsuba is not installed: pip install 'pbrdf[mitsuba]'")
accuracy = pytest.importorskip("tabulation_accuracy")


@pytest.fixture(scope="module")
def plastic() -> dict[str, tuple[float, float, float]]:
    """Of each way: share covered, median and 90th percentile of the errors."""
    found = accuracy.run(accuracy.TRIALS["plastic .3"])
    return {way: accuracy.figures(error) for way, error in found.items()}


def test_directions_between_two_lights_are_all_covered_and_exact(
    plastic: dict[str, tuple[float, float, float]],
) -> None:
    covered, median, p90 = plastic["bracketing"]
    assert covered > 0.999
    assert median < 4e-4
    assert p90 < 7.4e-3


def test_a_table_of_the_published_grid_is_as_exact_as_the_directions_themselves() -> None:
    """The cubic through four lights wins more than linear interpolation of the grid costs."""
    covered, median, p90 = accuracy.figures(accuracy.through_grid(accuracy.TRIALS["plastic .3"]))
    assert covered > 0.999
    assert median < 4e-4
    assert p90 < 7.4e-3


def test_the_supplements_way_leaves_gaps_and_is_many_times_less_exact(
    plastic: dict[str, tuple[float, float, float]],
) -> None:
    """A light that is not quite that of a bin shows it beside the plane of incidence, or not at all."""
    covered, median, p90 = plastic["nearest"]
    assert 0.7 < covered < 0.8
    assert median > 20 * plastic["bracketing"][1]
    assert p90 > 20 * plastic["bracketing"][2]


def test_a_metal_is_as_exact() -> None:
    """At a quarter of the pixels and half the lights of the whole trial."""
    gold = accuracy.TRIALS["gold .15"]
    found = accuracy.run(accuracy.Trial(gold.bsdf, gold.lights // 2, gold.pixels // 4))
    covered, median, p90 = accuracy.figures(found["bracketing"])
    assert covered > 0.999
    # interpolation between pixels four times as large, of second order
    assert median < 16 * 4e-4
    assert p90 < 16 * 1.4e-3
