"""Every page of the small workflow, opened in a real browser from the disk."""

from __future__ import annotations

import io
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from browser import Browser, Page
from PIL import Image
from small_workflow import snakemake

pytestmark = pytest.mark.workflow


@pytest.fixture
def page(browser: Browser) -> Page:
    return browser.new_page()


def pages(report: Path) -> list[Path]:
    return sorted(report.glob("*.html"))


def first_column(page: Page, table: str) -> list[Any]:
    rows = f"[...document.querySelectorAll('{table} tbody tr')]"
    return list(page.evaluate(f"{rows}.map(row => row.cells[0].textContent)"))


def test_every_page_opens_without_complaint_and_asks_nobody(finished: Path, page: Page) -> None:
    report = finished / "results/report"
    assert len(pages(report)) == 8
    for path in pages(report):
        page.open(path.as_uri())
        assert page.messages == [], path.name
        assert page.requests[0] == path.as_uri()
        scripts = {(report / name).as_uri() for name in ("report.js", "plotly.min.js")}
        assert set(page.requests[1:]) <= scripts, path.name


def test_nothing_that_a_page_holds_could_ask_anybody(finished: Path, page: Page) -> None:
    """The content policy refuses what a script tries."""
    for path in pages(finished / "results/report"):
        page.open(path.as_uri())
        assert page.evaluate("fetch('https://example.org/').then(() => 'sent', () => 'refused')") == "refused"
        assert any("Content Security Policy" in message for message in page.messages), path.name
        load = "new Promise(r => { const i = new Image(); i.onload = () => r('sent');"
        assert page.evaluate(
            f"{load} i.onerror = () => r('refused'); i.src = 'https://example.org/a.png'; }})"
        )
        assert not any("example.org" in asked for asked in page.requests), path.name


def test_every_link_leads_to_a_page(finished: Path, page: Page) -> None:
    report = finished / "results/report"
    for path in pages(report):
        page.open(path.as_uri())
        for link in page.evaluate("[...document.querySelectorAll('a')].map(a => a.getAttribute('href'))"):
            assert (report / link.partition("#")[0]).is_file(), f"{path.name} leads to {link}"


@pytest.mark.parametrize("width", [1300, 390], ids=["screen", "phone"])
def test_every_page_shows_something_and_fits_its_window(finished: Path, page: Page, width: int) -> None:
    page.resize(width, 900, phone=width < 500)
    for path in pages(finished / "results/report"):
        page.open(path.as_uri())
        assert page.evaluate("document.documentElement.scrollWidth") <= width, path.name
        shown = np.asarray(Image.open(io.BytesIO(page.screenshot(whole=False))).convert("L"))
        # text alone is some per cent of ink
        assert 0.01 < np.mean(shown < 128) < 0.9, path.name


def test_pictures_are_drawn_and_have_words(finished: Path, page: Page) -> None:
    for path in pages(finished / "results/report"):
        page.open(path.as_uri())
        images = page.evaluate("[...document.images].map(i => [i.naturalWidth, i.alt.length])")
        assert all(width > 0 and words > 0 for width, words in images), path.name


def test_heads_sort_by_key_and_by_number(finished: Path, page: Page) -> None:
    page.open((finished / "results/report/index.html").as_uri())
    given = first_column(page, "#sessions")
    assert len(given) == 6
    press = "document.querySelector('#sessions th button')"
    page.evaluate(f"{press}.focus()")
    page.press("Enter")
    assert first_column(page, "#sessions") == sorted(given)
    assert page.evaluate(f"{press}.parentNode.ariaSort") == "ascending"
    page.press(" ")
    assert first_column(page, "#sessions") == sorted(given, reverse=True)

    rows = "<tr><th>a</th><td><data value='{}'></data></td></tr>"
    body = "".join(rows.format(value) for value in (10.0, 9.0, "nan", -100.0))
    page.evaluate(f'document.querySelector("#sessions tbody").innerHTML = "{body}"')
    page.evaluate("document.querySelectorAll('#sessions th button')[1].click()")
    values = page.evaluate("[...document.querySelectorAll('#sessions data')].map(d => d.value)")
    assert values == ["-100.0", "9.0", "10.0", "nan"]


def test_the_zipped_report_leads_to_the_same_pages(finished: Path, tmp_path: Path, page: Page) -> None:
    archive = tmp_path / "report.zip"
    run = snakemake(finished, "--configfile", "config.yaml", "--report", str(archive))
    assert run.returncode == 0, run.stderr
    shutil.unpack_archive(archive, tmp_path)
    page.open((tmp_path / "report/report.html").as_uri())
    # Snakemake's own page warns of a tool that it was made with
    assert all("tailwindcss" in message for message in page.messages)
    assert all(asked.startswith("file:") for asked in page.requests)
    (index,) = (tmp_path / "report/data/raw").glob("*/index.html")
    made = {path.name: path.read_bytes() for path in pages(finished / "results/report")}
    assert {path.name: path.read_bytes() for path in pages(index.parent)} == made
    page.open(index.as_uri())
    page.evaluate("document.querySelector('#materials a').click()")
    page.browser.wait(lambda: page.evaluate("document.title") == "plastic", "the link does not work")
    assert page.messages == []
