"""The page of a validation: its figures, its pictures, its words."""

from __future__ import annotations

import re

import numpy as np
import pytest

from pbrdf.optics.elements import IDEAL
from pbrdf.reconstruction.comparison import Comparison, rms_over, worst
from pbrdf.reconstruction.lamp import LampMatrix
from pbrdf.reconstruction.validation import CALIBRATED, UNCALIBRATED, WAYS, Validation
from pbrdf.report.element_matrices import cell_text, matrices_picture
from pbrdf.report.validation import validation_page

HOSTILE = '<script>alert("x")</script>'
BANDS = (450, 550, 650)


def validation(source: str = "measured", bands: tuple[int, ...] = BANDS) -> Validation:
    """Five elements with noise of 0.001 where calibrated and 0.05 where not."""
    random = np.random.default_rng(5)

    def measured(element: str, sigma: float) -> Comparison:
        ideal = IDEAL[element] / IDEAL[element][0, 0]
        mueller = ideal + random.normal(0.0, sigma, (4, 4))
        sixteen = np.full((4, 4), 0.001)
        return Comparison(LampMatrix(mueller, sixteen, 30 * sixteen, 1e6, 1000), ideal, np.zeros((4, 4)))

    results = {
        element: {
            nm: {CALIBRATED: measured(element, 0.001), UNCALIBRATED: measured(element, 0.05)} for nm in bands
        }
        for element in IDEAL
    }
    return Validation(HOSTILE, {"polarimeter": source, "lights": "measured"}, results)


@pytest.fixture(scope="module")
def page() -> str:
    return validation_page(validation(), {"from": HOSTILE})


def shown(page: str) -> set[float]:
    """Numbers behind the text."""
    return {float(value) for value in re.findall(r'<data value="([^"]*)"', page)}


def test_the_same_validation_gives_the_same_bytes(page: str) -> None:
    assert validation_page(validation(), {"from": HOSTILE}) == page


def test_every_band_of_every_element_stands_there_both_ways(page: str) -> None:
    held = validation()
    for way in WAYS:
        for each in held.comparisons(way):
            assert {each.largest, each.largest_error, each.rms, each.noise_rms} <= shown(page)
        for bands in held.results.values():
            over_bands = [ways[way] for ways in bands.values()]
            assert {worst(over_bands).largest, rms_over(over_bands)} <= shown(page)
    assert page.count("<tbody>") == len(IDEAL)


def test_names_are_text_and_no_request_leaves_the_page(page: str) -> None:
    assert "<script" not in page
    assert "url(" not in page
    assert all(source.startswith("data:") for source in re.findall(r'src="([^"]*)"', page))
    ids = re.findall(r' id="([^"]*)"', page)
    assert len(ids) == len(set(ids)) > 0


def test_a_picture_a_band_and_the_published_one_first(page: str) -> None:
    pictures = re.findall(r'<img [^>]*alt="(\d+) nm: Mueller matrices', page)
    assert pictures == ["550", "450", "650"]


def test_without_the_published_band_the_middle_one_comes_first() -> None:
    page = validation_page(validation(bands=(450, 600, 650)), {})
    assert re.findall(r'alt="(\d+) nm', page) == ["600", "450", "650"]


@pytest.mark.parametrize("source", ["file", "measured"])
def test_the_page_says_where_the_polarimeter_comes_from(source: str) -> None:
    assert f"polarimeter</a> {source}" in validation_page(validation(source), {})


def test_the_page_links_to_the_calibrations_of_its_session() -> None:
    held = validation()
    page = validation_page(Validation("monday", held.sources, held.results), {})
    assert re.findall(r'href="([^"]*)"', page) == [
        "calibration_monday_polarimeter.html",
        "calibration_monday_lights.html",
    ]


def test_a_picture_says_in_words_what_it_shows() -> None:
    picture = matrices_picture(["air"], {"ideal": [np.eye(4)], "measured": [0.5 * np.eye(4)]}, "550 nm")
    assert "Diagonals, ideal: air 1, 1, 1, 1." in picture.alt
    assert "Diagonals, measured: air 0.5, 0.5, 0.5, 0.5." in picture.alt


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (1.0, "1"),
        (-1.0, "−1"),
        (6e-17, "0"),
        (-0.0, "0"),
        (-0.0002, "0.000"),
        (-0.16249, "−0.162"),
        (0.9996, "1.000"),
    ],
)
def test_a_cell_tells_what_is_exact_from_what_is_rounded(value: float, text: str) -> None:
    assert cell_text(value) == text
