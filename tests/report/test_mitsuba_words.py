"""What a material's page says of its files for Mitsuba."""

from __future__ import annotations

from pbrdf.report.mitsuba_words import mitsuba_words


def test_five_bands_need_no_words() -> None:
    assert mitsuba_words("jade", [450, 500, 550, 600, 650]) is None


def test_fewer_than_five_bands_are_said_to_make_no_file() -> None:
    words = mitsuba_words("jade", [450, 500])
    assert words is not None
    assert "has 2" in words and "nothing is written" in words


def test_many_bands_are_said_to_lie_five_to_a_file() -> None:
    words = mitsuba_words("jade", [400.0 + 5 * band for band in range(68)])
    assert words is not None
    assert "14 pairs" in words
    assert "jade_400-420nm.pbsdf" in words
    assert "715, 720 nm are in the file before" in words
    ten = mitsuba_words("jade", [400.0 + 5 * band for band in range(10)])
    assert ten is not None and "before it too" not in ten
