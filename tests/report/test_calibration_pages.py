"""Pages of calibrations: measured on the virtual rig in one band, and given as files."""

from __future__ import annotations

import json
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pbrdf.calibration.arm_problem import GivenRadius
from pbrdf.calibration.chessboard import Board
from pbrdf.calibration.documents import KINDS
from pbrdf.calibration.session_camera import calibrate_camera
from pbrdf.calibration.session_lights import calibrate_lights
from pbrdf.calibration.session_polarimeter import calibrate_polarimeter
from pbrdf.calibration.session_sphere import locate_sphere
from pbrdf.capture.material import capture_material
from pbrdf.capture.session import capture_target
from pbrdf.formats.documents import read_any
from pbrdf.reconstruction.session_radiometry import calibrate_flat, calibrate_radiometry
from pbrdf.report.calibration_page import write_calibration_page
from pbrdf.report.entries import calibration_link, read_calibration_entry
from pbrdf.report.polarimeter_signals import read_signals
from pbrdf.settings.checked import check
from pbrdf.settings.plan import capture_plan
from pbrdf.settings.rig import read_rig
from pbrdf.settings.targets import ambient_plan, session_plans

SOURCE = Path(__file__).resolve().parents[2] / "config/rig/virtual.yaml"
HOSTILE = '<script>alert("x")</script>&'
BOARD = Board((9, 7), 5.0)
CONFIG = {
    "materials": "materials.tsv",
    "plan": {
        "lights_deg": [20, 35, 50, 65, 80, 95, 110, 125],
        "bands_nm": [550],
        "states": {"count": 36, "step_deg": 5, "ratio": 5},
        "exposures_ms": [5, 80],
        "darks": 2,
        "references": 4,
    },
    "session": {"flat": {"exposures_ms": [1, 8, 16, 30], "darks": 4}},
}
REFERENCES = ("air", "LPH", "CPR")

EXPECTED = {
    "camera": [
        "focal_px",
        "principal_px",
        "standard_errors.focal_px",
        "standard_errors.principal_px",
        "rms_px",
        "covered",
        "models",
        "per_view",
    ],
    "polarimeter": [
        "zeros_deg",
        "zeros_standard_error_deg",
        "chi_square_per_freedom",
        "bands.550.generator_retardance_deg",
        "bands.550.generator_retardance_standard_error_deg",
        "bands.550.analyser_retardance_deg",
        "bands.550.analyser_retardance_standard_error_deg",
        "bands.550.references",
    ],
    "lights": [
        "centre_mm",
        "standard_errors.centre_mm",
        "radius_mm",
        "standard_errors.radius_mm",
        "standard_errors.direction_deg",
        "residuals_px",
        "highlights_px",
        "ball",
    ],
    "radiometry": [
        "dn_per_electron",
        "dn_per_electron_standard_error",
        "read_noise_dn",
        "read_noise_standard_error_dn",
        "chi_square_per_freedom",
        "scale",
        "scale_standard_error",
        "unevenness",
        "lamp_range",
        "reflectance",
    ],
    "flat": ["bands"],
    "sphere": ["centre_mm", "radius_mm", "standard_errors_mm", "outline_deg", "residual_px", "blur_px"],
}
"""Values of the documents that their pages show, with all that they hold."""


@dataclass(frozen=True)
class Session:
    """A folder with a session's photographs and the documents made of them."""

    folder: Path

    def manifests(self, target: str) -> list[str | Path]:
        return sorted(self.folder.glob(f"captures/{target}/lights/*/manifest.json"))

    def document(self, kind: str) -> Path:
        return self.folder / "monday" / f"{kind}.json"

    def photographs(self, kind: str) -> list[str | Path]:
        targets = {
            "camera": ["board_*"],
            "polarimeter": REFERENCES,
            "lights": ["chrome"],
            "sphere": ["plastic"],
        }
        return [path for target in targets.get(kind, []) for path in self.manifests(target)]

    def page(self, kind: str, document: Path, folder: Path, subject: str = "monday") -> str:
        """Write a page and read it."""
        write_calibration_page(
            kind,
            subject,
            document,
            self.photographs(kind),
            {"camera": self.document("camera")},
            BOARD,
            folder / f"{kind}.html",
            folder / f"{kind}.json",
        )
        return (folder / f"{kind}.html").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def session(tmp_path_factory: pytest.TempPathFactory) -> Session:
    """A session in which everything was measured."""
    held = Session(tmp_path_factory.mktemp("session"))
    settings, rig = check(CONFIG, "config", "config.yaml"), read_rig(SOURCE)
    plan = capture_plan(settings["plan"], rig, "config.yaml")
    for target, wanted in session_plans(plan, settings, "config.yaml").items():
        if target not in ("LPV", "CPL"):
            folder = held.folder / "captures" / target
            capture_target(wanted, rig.with_no_sphere(), SOURCE, target, settings["session"], folder)
    ambient = ambient_plan(plan, settings["session"], "config.yaml")
    alone = rig.with_sphere("plastic", SOURCE)
    capture_material(ambient, alone, SOURCE, "plastic", 25.0, held.folder / "captures/plastic", ambient=True)
    calibrate_camera(
        {Path(path).parents[2].name: path for path in held.photographs("camera")},
        BOARD,
        held.document("camera"),
    )
    calibrate_polarimeter(
        dict(zip(REFERENCES, held.photographs("polarimeter"), strict=True)), held.document("polarimeter")
    )
    calibrate_lights(
        held.manifests("chrome"),
        held.manifests("chrome_ambient")[0],
        held.document("camera"),
        held.document("polarimeter"),
        25.0,
        GivenRadius(803.0, 8.0),
        held.document("lights"),
    )
    calibrate_flat(held.manifests("flat")[0], held.document("flat"))
    calibrate_radiometry(
        held.manifests("flat")[0],
        held.manifests("spectralon"),
        {kind: held.document(kind) for kind in ("camera", "polarimeter", "lights", "flat")},
        0.99,
        held.document("radiometry"),
    )
    locate_sphere(held.manifests("plastic")[0], held.document("camera"), 25.0, held.document("sphere"))
    return held


@pytest.fixture(scope="module")
def pages(session: Session) -> dict[str, str]:
    return {kind: session.page(kind, session.document(kind), session.folder / "pages") for kind in KINDS}


def shown(page: str) -> set[float]:
    """Numbers behind the text."""
    return {float(value) for value in re.findall(r'<data value="([^"]*)"', page)}


def numbers_in(value: Any) -> set[float]:
    """All numbers of a part of a document."""
    if isinstance(value, dict):
        return set().union(*map(numbers_in, value.values()))
    if isinstance(value, list):
        return set().union(*map(numbers_in, value))
    return {float(value)} if isinstance(value, int | float) else set()


def numbers_at(content: dict[str, Any], field: str) -> set[float]:
    value: Any = content
    for part in field.split("."):
        value = value[part]
    return numbers_in(value)


@pytest.mark.parametrize("kind", KINDS)
def test_every_value_shown_is_the_documents(session: Session, pages: dict[str, str], kind: str) -> None:
    content = read_any(session.document(kind))
    for field in EXPECTED[kind]:
        assert numbers_at(content, field) <= shown(pages[kind]), field


@pytest.mark.parametrize("kind", KINDS)
def test_the_verdict_comes_first(session: Session, pages: dict[str, str], kind: str) -> None:
    verdict = read_any(session.document(kind))["verdict"]
    text = re.sub(r"<[^>]*>", "", pages[kind].split("</h1>")[1]).strip()
    assert text.replace("&#39;", "'").startswith(verdict)


@pytest.mark.parametrize("kind", KINDS)
def test_the_same_photographs_give_the_same_bytes(
    session: Session, pages: dict[str, str], kind: str, tmp_path: Path
) -> None:
    assert session.page(kind, session.document(kind), tmp_path) == pages[kind]


@pytest.mark.parametrize("kind", KINDS)
def test_pictures_say_what_they_show_and_no_request_leaves_the_page(pages: dict[str, str], kind: str) -> None:
    page = pages[kind]
    pictures = re.findall(r"<img [^>]*>", page)
    assert pictures
    assert all(re.search(r'src="data:image/[^"]*" alt="[^"]{20,}"', each) for each in pictures)
    assert "url(" not in page
    assert re.findall(r'href="([^"]*)"', page) == ["index.html"]


@pytest.mark.parametrize("kind", KINDS)
def test_names_and_verdicts_are_text(session: Session, kind: str, tmp_path: Path) -> None:
    document = changed(session, kind, tmp_path, verdict=HOSTILE)
    page = session.page(kind, document, tmp_path, subject=HOSTILE)
    assert "<script" not in page
    assert page.count("&lt;script&gt;") >= 3
    entry = read_calibration_entry(tmp_path / f"{kind}.json")
    assert (entry.subject, entry.verdict, entry.link) == (HOSTILE, HOSTILE, f"{kind}.html")


def changed(session: Session, kind: str, folder: Path, **changes: Any) -> Path:
    """A document with other entries; a flat field's image lies beside it."""
    path = folder / "documents" / f"{kind}.json"
    path.parent.mkdir()
    content = read_any(session.document(kind)) | changes
    path.write_text(json.dumps(content), encoding="utf-8")
    if kind == "flat":
        image = session.document(kind).with_suffix(".exr")
        path.with_suffix(".exr").write_bytes(image.read_bytes())
    return path


@pytest.mark.parametrize("kind", KINDS)
def test_what_is_given_as_a_file_is_called_so_and_not_drawn(
    session: Session, kind: str, tmp_path: Path
) -> None:
    page = session.page(kind, changed(session, kind, tmp_path, source="file"), tmp_path)
    assert "Given as a file" in page
    assert "<img" not in page
    assert "source" in page
    assert read_calibration_entry(tmp_path / f"{kind}.json").source == "file"


@pytest.mark.parametrize("kind", ["polarimeter", "lights", "radiometry", "flat"])
def test_what_must_not_be_used_is_shown_all_the_more(session: Session, kind: str, tmp_path: Path) -> None:
    page = session.page(
        kind, changed(session, kind, tmp_path, verdict="unusable: look", usable=False), tmp_path
    )
    assert "unusable: look" in page
    assert "<img" in page


def test_the_polarimeters_curves_are_those_of_its_document(session: Session) -> None:
    """What is drawn as predicted leaves over what the fit left over."""
    content = read_any(session.document("polarimeter"))
    manifests = dict(zip(REFERENCES, session.photographs("polarimeter"), strict=True))
    signals = read_signals(session.document("polarimeter"), content, manifests)
    for index, name in enumerate(REFERENCES):
        residual = (signals.signal - signals.predicted)[index, 0]
        expected = content["bands"]["550"]["references"][name]["residual_rms"]
        assert np.sqrt(np.mean(residual**2)) == pytest.approx(expected, rel=1e-6)
        before, after = (
            np.abs(matrices[550][index] - signals.ideal[index]).max()
            for matrices in (signals.before, signals.after)
        )
        assert after < 0.001
        assert 20 * after < before


def test_pixels_of_the_disc_agree_with_the_polarimeter_to_their_noise(session: Session) -> None:
    """Of 39 photographs a pixel's residual scatters by a ninth about one; half a thousand pixels by less."""
    content = read_any(session.document("polarimeter"))
    manifests = dict(zip(REFERENCES, session.photographs("polarimeter"), strict=True))
    for of_band in read_signals(session.document("polarimeter"), content, manifests).discs:
        known = of_band[0][np.isfinite(of_band[0])]
        assert known.size > 500
        assert np.median(known) == pytest.approx(1.0, abs=0.08)


def test_edges_on_the_outline_are_as_far_off_as_the_document_says(
    session: Session, pages: dict[str, str]
) -> None:
    rms = read_any(session.document("sphere"))["residual_px"]
    found = re.search(r"edge points from the outline around it; rms ([\d.]+) px", pages["sphere"])
    assert found is not None
    assert float(found[1]) == pytest.approx(rms, rel=0.01)


def test_a_page_lies_where_its_links_lead() -> None:
    assert calibration_link("results/calibration/monday/camera.json") == "calibration_monday_camera.html"
    assert calibration_link("results/gold/sphere.json") == "calibration_gold_sphere.html"
