"""Every page of the small workflow, opened in a real browser from the disk."""

from __future__ import annotations

import io
import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from browser import Browser, Page
from PIL import Image
from small_workflow import snakemake

import pbrdf
from pbrdf.report.panels_data import decoded

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
        scripts = {(report / name).as_uri() for name in ("report.js", "plotly.min.js", "panels.js")}
        scripts |= {values.as_uri() for values in (report / "values").glob("*/*.js")}
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


def test_every_page_prints_whole_on_white(finished: Path, page: Page) -> None:
    page.print_preview(718)
    for path in pages(finished / "results/report"):
        page.open(path.as_uri())
        page.evaluate("document.querySelectorAll('details').forEach(part => { part.open = true; })")
        wide = "[...document.querySelectorAll('table, img, #panels-drawing')]"
        right = page.evaluate(f"{wide}.map(part => part.getBoundingClientRect().right)")
        assert max(right, default=0) <= 718, path.name
        ground = page.evaluate("getComputedStyle(document.body).backgroundColor")
        assert ground == "rgb(255, 255, 255)", path.name


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


@pytest.mark.parametrize("name", ["index", "plastic"])
def test_keys_reach_all_that_can_be_pressed_or_moved(finished: Path, page: Page, name: str) -> None:
    page.open((finished / f"results/report/{name}.html").as_uri())
    tags = "a, button, input, select, summary"
    page.evaluate(f"window.parts = [...document.querySelectorAll('{tags}')]")
    shown = page.evaluate(
        "window.parts.map((part, n) => [n, part.checkVisibility()]).filter(at => at[1]).map(at => at[0])"
    )
    assert len(shown) > 10
    reached = []
    while len(reached) < 2 * len(shown):
        page.press("Tab")
        now = page.evaluate("window.parts.indexOf(document.activeElement)")
        if now >= 0:
            assert page.evaluate("getComputedStyle(document.activeElement).outlineStyle") != "none"
            reached.append(now)
        elif reached and page.evaluate("document.activeElement === document.body"):
            break
    assert reached == shown


def test_the_zipped_report_leads_to_the_same_pages(finished: Path, tmp_path: Path, page: Page) -> None:
    archive = tmp_path / "report.zip"
    run = snakemake(finished, "--configfile", "config.yaml", "--report", str(archive))
    assert run.returncode == 0, run.stderr
    shutil.unpack_archive(archive, tmp_path)
    page.open((tmp_path / "report/report.html").as_uri())
    # Snakemake's own page warns of a tool that it was made with
    assert all("tailwindcss" in message for message in page.messages)
    assert all(asked.startswith("file:") for asked in page.requests)
    assert set(page.evaluate("Object.keys(categories)")) == {"Pages", "Models"}
    shown = page.evaluate("Object.values(results).map(r => [Object.keys(r.labels).length, r.caption])")
    assert all(labels > 0 and len(caption) > 50 for labels, caption in shown)
    (index,) = (tmp_path / "report/data/raw").glob("*/index.html")
    made = {path.name: path.read_bytes() for path in pages(finished / "results/report")}
    assert {path.name: path.read_bytes() for path in pages(index.parent)} == made
    page.open(index.as_uri())
    page.follow("#materials a")
    assert page.evaluate("document.title") == "plastic"
    assert page.messages == []


def wait_until_drawn(page: Page) -> None:
    look = "document.getElementById('panels-drawing').dataset.drawn === 'yes' ? done() : setTimeout(look, 10)"
    page.evaluate(f"new Promise(done => {{ const look = () => {look}; look(); }})")


def drawn(page: Page, finished: Path) -> dict[str, Any]:
    """Open the material's page, wait until its panels are drawn, and read the document of whole slices."""
    page.open((finished / "results/report/plastic.html").as_uri())
    wait_until_drawn(page)
    link = page.evaluate("document.querySelector('#panels-view a').getAttribute('href')")
    document: dict[str, Any] = json.loads((finished / "results/report" / link).read_text(encoding="utf-8"))
    return document


def set_control(page: Page, name: str, value: int) -> None:
    control = f"document.getElementById('panels-{name}')"
    page.evaluate(f"{control}.value = {value}; {control}.dispatchEvent(new Event('input'))")
    wait_until_drawn(page)


def said(page: Page, name: str) -> float:
    """Angle that a slider says."""
    return float(page.evaluate(f"document.getElementById('panels-{name}-text').textContent").strip("°"))


def shown_matrix(page: Page) -> np.ndarray[Any, Any]:
    cells = "[...Array(16).keys()].map(k => document.getElementById(`panels-m${k}`)"
    texts = page.evaluate(f"{cells}.textContent)")
    values = [float(value) for value in page.evaluate(f"{cells}.value)")]
    # what is read is what is behind it, to three digits
    np.testing.assert_allclose([float(t.replace("−", "-")) for t in texts], values, rtol=5.1e-3)
    return np.reshape(values, (4, 4))


def as_shown(mueller: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    shown = mueller.astype(np.float64) / mueller[0, 0]
    shown[0, 0] = mueller[0, 0]
    return shown


def test_values_shown_are_those_of_the_document(finished: Path, page: Page) -> None:
    document = drawn(page, finished)
    for plane, told in enumerate(document["slices"]):
        values = decoded(told["mueller"]["base64"], told["mueller"]["shape"])
        set_control(page, "plane", plane)
        for band, half, across in ((0, 1, 3), (2, 4, 5), (4, 0, 2)):
            for name, value in (("band", band), ("half", half), ("across", across)):
                set_control(page, name, value)
            np.testing.assert_allclose(shown_matrix(page), as_shown(values[band, half, across]), rtol=1e-6)
            where = page.evaluate("document.getElementById('panels-where').textContent")
            assert f"{document['wavelengths']['values'][band]:g} nm, {told['label']}" in where


def test_every_slice_shows_the_table(finished: Path, page: Page) -> None:
    drawn(page, finished)
    table = pbrdf.open_table(finished / "results/plastic/table.zarr").data
    for plane, (held, axis) in enumerate((("theta_d", 1), ("phi_d", 2))):
        set_control(page, "plane", plane)
        slices = 1 + int(page.evaluate("document.getElementById('panels-held').max"))
        assert slices >= 5
        found = set()
        for which in range(slices):
            set_control(page, "held", which)
            angle = said(page, "held")
            node = int(np.abs(np.degrees(getattr(table, held)) - angle).argmin())
            found.add(node)
            set_control(page, "half", 2)
            set_control(page, "across", 4)
            expected = table.mueller[2].take(node, axis)[2, 4]
            np.testing.assert_allclose(shown_matrix(page), as_shown(expected), rtol=1e-6)
        assert len(found) == slices


def test_sliders_move_the_panels_by_keyboard_too(finished: Path, page: Page) -> None:
    drawn(page, finished)
    colours = "JSON.stringify(document.getElementById('panels-drawing').data.map(t => t.z))"
    before = page.evaluate(colours)
    page.evaluate("document.getElementById('panels-band').focus()")
    page.press("ArrowRight")
    page.browser.wait(lambda: page.evaluate(colours) != before, "the panels stay as they were")
    assert page.evaluate("document.getElementById('panels-band-text').textContent") == "600 nm"
    assert page.messages == []


def test_the_difference_is_that_of_model_and_table(finished: Path, page: Page) -> None:
    drawn(page, finished)
    matrices = []
    for source in range(3):
        set_control(page, "source", source)
        matrices.append(shown_matrix(page))
    table, model, difference = matrices
    expected = model - table
    expected[0, 0] *= 100 / table[0, 0]
    np.testing.assert_allclose(difference, expected, rtol=1e-9, atol=1e-12)


def test_the_pointer_tells_the_value_under_it(finished: Path, page: Page) -> None:
    drawn(page, finished)
    page.resize(1300, 1400)
    page.evaluate("document.getElementById('panels-drawing').scrollIntoView()")
    place = page.evaluate(
        "(({x, y, width, height}) => [x, y, width, height])"
        "(document.querySelector('#panels-drawing .nsewdrag').getBoundingClientRect())"
    )
    page.point(place[0] + 0.3 * place[2], place[1] + 0.3 * place[3])
    tip = "document.querySelector('#panels-drawing .hoverlayer')?.textContent ?? ''"
    page.browser.wait(lambda: "M00, 1/sr" in page.evaluate(tip), "no value is told")
    value = float(page.evaluate(tip).partition("M00, 1/sr: ")[2].partition("θh")[0])
    assert value == pytest.approx(shown_matrix(page)[0, 0], rel=5.1e-3)


def test_pages_are_small_and_open_soon(finished: Path, page: Page) -> None:
    for path in pages(finished / "results/report"):
        assert path.stat().st_size < 8e6
        before = page.busy_s()
        page.open(path.as_uri())
        if path.name == "plastic.html":
            wait_until_drawn(page)
        # a material's page takes 1.4 s and the index 0.03 s of a processor that three others share
        assert page.busy_s() - before < (4.0 if path.name == "plastic.html" else 0.5), path.name
        assert page.evaluate("performance.getEntriesByType('navigation')[0].loadEventEnd") < 20_000
