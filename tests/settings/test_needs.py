"""What jobs ask for grows with the problem, and at the paper's size stays below what was promised."""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path

import pytest

from pbrdf.settings.needs import STEPS, Problem, needs

SMALL = Problem(
    lights=28,
    bands=5,
    states=36,
    exposures=2,
    frames_per_light=398,
    pixels=192 * 192,
    word_bytes=2,
    nodes=(46, 46, 181),
    fitted_share=1 / 8,
    fits=3,
)
PAPER = replace(
    SMALL,
    lights=90,
    exposures=3,
    frames_per_light=597,
    pixels=3376 * 2704,
    nodes=(91, 91, 361),
    fitted_share=1 / 64,
    fits=4,
)


@pytest.mark.parametrize("step", STEPS)
def test_no_step_asks_for_less_where_there_is_more_to_do(step: str) -> None:
    small, large = needs(step, SMALL), needs(step, PAPER)
    assert all(more >= less > 0 for more, less in zip(large, small, strict=True))


@pytest.mark.parametrize("step", ["reconstruct", "slice", "tabulate", "export", "fit"])
def test_a_paper_sized_light_and_its_table_stay_below_6_gb(step: str) -> None:
    assert needs(step, PAPER).mem_mb < 6000


def test_lights_are_no_reason_for_memory() -> None:
    for step in STEPS:
        assert needs(step, replace(PAPER, lights=900)).mem_mb == needs(step, PAPER).mem_mb


def test_photographs_of_a_paper_sized_material_are_counted() -> None:
    raw = 90 * 597 * 3376 * 2704 * 2
    assert needs("photograph", PAPER).disk_mb == pytest.approx(0.6 * raw / 1e6, abs=1)


def measured() -> list[dict[str, str]]:
    """Steps of problems of several sizes: plans of `PAPER` with other frames, lights and bands."""
    path = Path(__file__).resolve().parents[2] / "docs/growth.csv"
    with path.open(encoding="utf-8", newline="") as stream:
        return [row for row in csv.DictReader(stream) if row["step"] in STEPS]


@pytest.mark.parametrize("row", measured(), ids=lambda row: "-".join(row.values()))
def test_what_is_asked_for_is_what_was_measured_and_a_margin(row: dict[str, str]) -> None:
    bands = int(row["bands"])
    problem = replace(
        PAPER,
        lights=int(row["lights"]),
        bands=bands,
        frames_per_light=(bands * 39 + 4) * 3,
        pixels=int(row["side_px"]) ** 2,
    )
    asked = needs(row["step"], problem)
    assert 1.1 < asked.mem_mb / (float(row["rss_mb"]) * 1.048576) < 2.2
    assert asked.runtime * 60 > 2 * float(row["core_s"])
