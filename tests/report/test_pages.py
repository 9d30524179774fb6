from __future__ import annotations

import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pbrdf.errors import InputError
from pbrdf.fitting import FitResult
from pbrdf.fitting.comparison import compare
from pbrdf.formats.table_data import Origin, TableData
from pbrdf.report.entries import (
    CalibrationEntry,
    FitEntry,
    IndexEntry,
    read_calibration_entry,
    read_entry,
    write_calibration_entry,
    write_entry,
)
from pbrdf.report.fit_view import median_error, ranked, tie_words
from pbrdf.report.image_view import MuellerImage
from pbrdf.report.pages import image_page, index_page, material_entry, material_page
from pbrdf.report.panels_data import drawn_panels
from pbrdf.report.table_view import PUBLISHED_GRID, offered_slices, whole_slices
from pbrdf.report.visibility import coverage

SOURCES = {"camera": "measured", "polarimeter": "file"}
HOSTILE = '<script>alert("x")</script>&'


class _Page(HTMLParser):
    """Elements of a page: their attributes, the numbers behind the text, and all text."""

    VOID = ("meta", "img", "br", "link", "input")

    def __init__(self, page: str) -> None:
        super().__init__()
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.open: list[str] = []
        self.text = ""
        self.feed(page)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, dict(attrs)))
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if not self.open or self.open[-1] != "style":
            self.text += data

    def attributes(self, tag: str, name: str) -> list[str]:
        return [attrs[name] or "" for t, attrs in self.elements if t == tag and name in attrs]

    @property
    def numbers(self) -> list[float]:
        return [float(value) for value in self.attributes("data", "value")]


@pytest.fixture(scope="module")
def page(table: TableData, fitted: FitResult) -> str:
    return material_page(
        HOSTILE,
        table,
        [fitted],
        calibration_sources=SOURCES,
        provenance={HOSTILE: HOSTILE},
        index="index.html",
    )


@pytest.fixture(scope="module")
def image() -> MuellerImage:
    mueller = np.random.default_rng(2).uniform(0.1, 1.0, (16, 20, 30))
    return MuellerImage(mueller, "DN", "630 nm", summary={"residual_rms": 0.378, "condition": 34.38})


@pytest.fixture(scope="module")
def interactive(table: TableData, fitted: FitResult) -> str:
    provenance = {HOSTILE: HOSTILE}
    panels = drawn_panels("values/a", table, fitted, offered_slices(table), whole_slices(table))
    return material_page(
        HOSTILE, table, [fitted], calibration_sources=SOURCES, provenance=provenance, panels=panels
    )


def _pages(page: str, interactive: str, image: MuellerImage) -> list[str]:
    entry = IndexEntry(
        HOSTILE, "a.html", "table", 5, 61.0, (FitEntry(HOSTILE, 3.0, best=True),), "file", "data:,", HOSTILE
    )
    return [
        page,
        interactive,
        image_page(HOSTILE, [image], calibration_sources={}, provenance={}),
        index_page([entry], provenance={HOSTILE: HOSTILE}),
    ]


def test_same_inputs_give_the_same_bytes(page: str, table: TableData, fitted: FitResult) -> None:
    again = material_page(
        HOSTILE,
        table,
        [fitted],
        calibration_sources=SOURCES,
        provenance={HOSTILE: HOSTILE},
        index="index.html",
    )
    assert again == page


def test_names_are_text_wherever_they_stand(page: str, interactive: str, image: MuellerImage) -> None:
    for html in _pages(page, interactive, image):
        assert "<script>" not in html
        assert HOSTILE in _Page(html).text


def test_no_request_leaves_a_page(page: str, interactive: str, image: MuellerImage) -> None:
    for html in _pages(page, interactive, image):
        parsed = _Page(html)
        assert all(src.startswith("data:") for src in parsed.attributes("img", "src"))
        assert all(
            re.fullmatch(r"[\w.-]+\.html|values/a\.json", href) for href in parsed.attributes("a", "href")
        )
        assert not {"link", "iframe", "object"} & {tag for tag, _ in parsed.elements}
        assert set(parsed.attributes("script", "src")) <= {"report.js", "plotly.min.js", "panels.js"}
        assert "url(" not in html and "@import" not in html
        assert any("default-src 'none'" in c for c in parsed.attributes("meta", "content"))


def test_elements_are_closed_and_ids_are_unique(page: str, interactive: str, image: MuellerImage) -> None:
    for html in _pages(page, interactive, image):
        parsed = _Page(html)
        assert parsed.open == []
        ids = [attrs["id"] for _, attrs in parsed.elements if "id" in attrs]
        assert len(ids) == len(set(ids))


def test_every_picture_has_words(page: str, interactive: str, image: MuellerImage) -> None:
    for html in _pages(page, interactive, image)[:3]:
        parsed = _Page(html)
        alts = parsed.attributes("img", "alt")
        assert len(alts) == len(parsed.attributes("img", "src")) > 0
        assert all(len(alt) > 60 for alt in alts)


def test_numbers_behind_the_text_are_those_of_the_fit(page: str, fitted: FitResult) -> None:
    shown = _Page(page).numbers
    expected = [value for p in fitted.parameters for value in p.values]
    expected += [v for band in fitted.residuals.rms for row in band for v in row]
    expected += [error for p in fitted.parameters for error in p.standard_errors if error is not None]
    found = fitted.residuals
    expected += [found.cost, found.cost_per_node, *found.nodes, fitted.options.seed]
    assert set(expected) <= set(shown)


def test_numbers_behind_the_text_are_those_of_the_table(page: str, table: TableData) -> None:
    covered = coverage(table)
    shown = _Page(page).numbers
    assert {100 * share for share in covered.origins.values()} <= set(shown)
    assert covered.visible in shown


def test_verdict_tells_bands_coverage_and_fit(page: str, table: TableData, fitted: FitResult) -> None:
    share = f"{100 * coverage(table).origins[Origin.MEASURED]:.3g}"
    error = f"{100 * median_error(fitted, table):.2g}"
    text = _Page(page).text.replace("\u00a0", " ")
    assert f"2 bands, {share} % of the visible nodes measured" in text
    assert f"Baek 2018 fits M00 with a median error of {error} %." in text


def test_median_error_is_that_of_the_noise(table: TableData, fitted: FitResult) -> None:
    # the median of |x| for a normal x is 0.6745 σ, and each matrix was multiplied by N(1, 0.02)
    assert median_error(fitted, table) == pytest.approx(0.6745 * 0.02, rel=0.1)


def test_the_page_says_where_each_calibration_comes_from(page: str) -> None:
    assert "camera measured; polarimeter file." in " ".join(_Page(page).text.split())


def test_measured_calibrations_give_no_warning(table: TableData) -> None:
    html = material_page("a", table, [], calibration_sources={"camera": "measured"}, provenance={})
    assert 'class="notice warning"' not in html
    assert "camera measured." in _Page(html).text


def test_a_table_without_a_fit_still_has_a_page(table: TableData) -> None:
    text = _Page(material_page("a", table, [], calibration_sources={}, provenance={})).text
    assert "no model was fitted" in text
    assert "not known here: the data came as a file" in text


def test_page_says_what_a_table_leaves_untold(table: TableData) -> None:
    bare = replace(table, origin=None, count=None)
    text = _Page(material_page("a", bare, [], calibration_sources={}, provenance={})).text
    assert "no variance" in text
    assert "measured and filled look alike" in text
    assert "11×10×25 nodes (θh, θd, φd) is coarser than the published 91×91×361" in text


def test_a_table_of_which_nothing_is_known_still_has_a_page(table: TableData) -> None:
    empty = replace(table, mueller=np.full_like(table.mueller, np.nan), origin=None, count=None)
    text = _Page(material_page("a", empty, [], calibration_sources={}, provenance={})).text
    assert "0\u00a0% of the visible nodes known" in text


def test_page_of_a_full_noisy_table_stays_below_8_mb(fitted: FitResult) -> None:
    bands, (halves, differences, azimuths) = 5, PUBLISHED_GRID
    random = np.random.default_rng(3)
    # one plane of noise stands for all θd: memory is not the matter here
    plane = random.normal(0.0, 1.0, (bands, halves, 1, azimuths, 4, 4)).astype(np.float32)
    plane[..., 0, 0] = random.lognormal(size=plane.shape[:4])
    table = TableData(
        "noise",
        np.array([450.0, 500.0, 550.0, 600.0, 650.0]),
        np.linspace(0, 1, halves) ** 2 * np.pi / 2,
        np.radians(np.linspace(0, 90, differences)),
        np.radians(np.linspace(-180, 180, azimuths)),
        np.broadcast_to(plane, (bands, halves, differences, azimuths, 4, 4)),
    )
    fit = _of_more_bands(fitted, table)
    panels = drawn_panels("values/noise", table, fit, offered_slices(table), whole_slices(table))
    for shown in (None, panels):
        html = material_page("noise", table, [fit], calibration_sources={}, provenance={}, panels=shown)
        assert len(html.encode()) < 8e6


def _of_more_bands(fitted: FitResult, table: TableData) -> FitResult:
    """Fit of two bands as one of as many as a table has."""

    def spread(values: tuple[Any, ...]) -> tuple[Any, ...]:
        return tuple(values[k % len(values)] for k in range(len(table.wavelengths_nm)))

    residuals = fitted.residuals
    return replace(
        fitted,
        wavelengths_nm=tuple(float(w) for w in table.wavelengths_nm),
        parameters=tuple(
            p if p.shared else replace(p, values=spread(p.values), standard_errors=spread(p.standard_errors))
            for p in fitted.parameters
        ),
        residuals=replace(
            residuals,
            rms=spread(residuals.rms),
            relative=spread(residuals.relative),
            nodes=spread(residuals.nodes),
        ),
        options=replace(fitted.options, downsample=16),
    )


def test_fit_of_another_table_is_refused(table: TableData, fitted: FitResult) -> None:
    other = replace(fitted, wavelengths_nm=(450.0, 600.0))
    with pytest.raises(InputError, match="wavelengths_nm"):
        material_page("a", table, [other], calibration_sources={}, provenance={})


def test_image_page_shows_how_the_image_was_solved(image: MuellerImage) -> None:
    parsed = _Page(image_page("faces", [image], calibration_sources={"polarimeter": "file"}, provenance={}))
    assert {0.378, 34.38} <= set(parsed.numbers)
    assert "0.378\u00a0DN" in parsed.text
    assert "polarimeter file." in parsed.text


def test_image_page_shows_the_median_diagonal(image: MuellerImage) -> None:
    m = np.asarray(image.mueller)
    expected = [float(np.median(m[5 * k] / m[0])) for k in range(4)]
    shown = _Page(image_page("faces", [image], calibration_sources={}, provenance={})).numbers
    assert set(expected) <= set(shown)


def test_image_of_another_shape_is_refused(image: MuellerImage) -> None:
    wrong = replace(image, mueller=np.zeros((20, 30, 16)))
    with pytest.raises(InputError, match="mueller"):
        image_page("faces", [wrong], calibration_sources={}, provenance={})


def test_index_links_every_material_and_names_the_closest_fit() -> None:
    entries = [
        IndexEntry(
            "gold",
            "gold.html",
            "table",
            5,
            61.0,
            (FitEntry("Baek 2018", 12.0), FitEntry("Hyde 2009", 13.0, best=True)),
            "measured",
        ),
        IndexEntry(
            "peek", "peek.html", "table", 5, 60.0, (FitEntry("Baek 2018", 3.0, best=True),), "measured"
        ),
        IndexEntry("faces", "faces.html", "Mueller image", 1, None, (), "not known"),
    ]
    parsed = _Page(index_page(entries, provenance={}))
    assert parsed.attributes("a", "href") == ["gold.html", "peek.html", "faces.html"]
    assert "closest fit is that of peek" in parsed.text
    assert {61.0, 12.0, 13.0, 60.0, 3.0} <= set(parsed.numbers)


def test_index_marks_the_best_model_of_each_material_and_what_is_as_close() -> None:
    fits = (
        FitEntry("Baek 2018", 12.0),
        FitEntry("Hyde 2009", 13.0, best=True),
        FitEntry("C", 14.0, tied=True),
    )
    page = index_page([IndexEntry("gold", "gold.html", "table", 5, 61.0, fits, "measured")], provenance={})
    rows = re.findall(r'<td( class="best")?><data value="(1[234]\.0)">[^<]*</data>(.*?)</td>', page)
    assert [(row[0], row[1]) for row in rows] == [("", "12.0"), (' class="best"', "13.0"), ("", "14.0")]
    assert [sign in row[2] for row, sign in zip(rows, "-★☆", strict=True)] == [False, True, True]


def test_a_tie_goes_to_fewer_parameters_and_is_told(table: TableData, fitted: FitResult) -> None:
    """An index that has come out real is no better than a real one."""
    nodes, cost = sum(fitted.residuals.nodes), fitted.residuals.cost
    extinction = replace(fitted.parameters[0], name="kappa", shared=True)

    def complex_at(cost: float) -> FitResult:
        residuals = replace(fitted.residuals, cost=cost)
        more = (*fitted.parameters, extinction)
        return replace(fitted, model="baek2018_complex", residuals=residuals, parameters=more)

    tied, better = complex_at(cost * (1 - 1 / nodes**0.5)), complex_at(cost * (1 - 3 / nodes**0.5))
    assert [fit.model for fit in ranked([tied, fitted])] == ["baek2018", "baek2018_complex"]
    assert ranked([fitted, better])[0] is better
    assert tie_words(ranked([fitted, better])) == ""
    assert (
        "Baek 2018, complex index comes as close within the scatter of the nodes, with more parameters"
        in tie_words(ranked([tied, fitted]))
    )
    entry = material_entry("a", "a.html", table, [fitted, replace(fitted, model="baek2018")], {})
    assert [(fit.best, fit.tied) for fit in entry.fits] == [(True, False), (False, True)]


def test_an_index_of_nothing_says_so() -> None:
    assert "No materials yet." in _Page(index_page([], provenance={})).text


def test_entries_return_from_their_files(tmp_path: Path, table: TableData, fitted: FitResult) -> None:
    entry = material_entry("gold", "gold.html", table, [fitted], SOURCES)
    write_entry(tmp_path / "gold.json", entry)
    assert read_entry(tmp_path / "gold.json") == entry
    assert entry.calibration == "polarimeter file; camera measured"


def test_the_index_leads_to_every_calibration(tmp_path: Path) -> None:
    link = "calibration_monday_camera.html"
    entry = CalibrationEntry(HOSTILE, "camera", link, "measured", "good")
    write_calibration_entry(tmp_path / "camera.json", entry)
    assert read_calibration_entry(tmp_path / "camera.json") == entry
    page = _Page(index_page([], [entry], provenance={}))
    assert page.attributes("a", "href") == [link]
    assert f"camera{HOSTILE}measuredgood" in page.text


def test_a_material_leads_to_its_calibrations(image: MuellerImage) -> None:
    link = "calibration_monday_polarimeter.html"
    page = _Page(
        image_page(
            "faces",
            [image],
            calibration_sources={"polarimeter": "measured", "flat": "file"},
            calibration_links={"polarimeter": link},
            provenance={},
        )
    )
    assert page.attributes("a", "href") == [link]
    assert "polarimeter measured; flat file." in " ".join(page.text.split())


def test_models_stand_beside_their_table(table: TableData, fitted: FitResult) -> None:
    content = compare("gold", table, [fitted]).content()
    parsed = _Page(
        material_page("gold", table, [fitted], calibration_sources={}, provenance={}, comparison=content)
    )
    expected = [albedo["models"]["baek2018"] for albedo in content["albedo"][6:]]
    expected += [angle["models"]["baek2018"] for angle in content["brewster"]]
    expected.append(content["models"][0]["fitted"]["cost"]["per_node"])
    assert set(expected) <= set(parsed.numbers)
    assert "conserves energy at the angles looked at" in parsed.text
    assert any("Degree of linear polarisation" in alt for alt in parsed.attributes("img", "alt"))
