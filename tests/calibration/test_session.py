"""A virtual session's photographs to its documents, held against the rig's truth."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pbrdf.calibration.arm_problem import GivenRadius
from pbrdf.calibration.camera import Camera
from pbrdf.calibration.chessboard import Board
from pbrdf.calibration.lights import read_lights
from pbrdf.calibration.polarimeter import ELEMENTS, PolarimeterCalibration
from pbrdf.calibration.session_camera import calibrate_camera
from pbrdf.calibration.session_lights import calibrate_lights
from pbrdf.calibration.session_polarimeter import calibrate_polarimeter
from pbrdf.calibration.session_sphere import locate_sphere
from pbrdf.calibration.sphere import Sphere
from pbrdf.capture.material import capture_material
from pbrdf.capture.session import capture_target
from pbrdf.errors import InputError
from pbrdf.instruments.virtual_chrome import OFFSET_MM
from pbrdf.instruments.virtual_geometry import virtual_arm, virtual_polarimeter
from pbrdf.settings.checked import check
from pbrdf.settings.plan import CapturePlan, capture_plan
from pbrdf.settings.rig import RigSettings
from pbrdf.settings.targets import ambient_plan, session_plans

LIGHTS = [20, 45, 70, 95, 120, 145, 170]
REFERENCES = ("air", "LPH", "CPR")
BANDS = [450, 600]
ARM = GivenRadius(803.0, 8.0)
CONFIG: dict[str, Any] = {
    "materials": "materials.tsv",
    "plan": {
        "lights_deg": LIGHTS,
        "bands_nm": BANDS,
        "states": {"count": 36, "step_deg": 5, "ratio": 5},
        "exposures_ms": [5, 80],
        "references": 4,
    },
}
SETTINGS = check(CONFIG, "config", "test")


@pytest.fixture(scope="module")
def plans(virtual: RigSettings) -> dict[str, CapturePlan]:
    return session_plans(capture_plan(SETTINGS["plan"], virtual, "test"), SETTINGS, "test")


@pytest.fixture(scope="module")
def session(
    tmp_path_factory: pytest.TempPathFactory, virtual: RigSettings, plans: dict[str, CapturePlan]
) -> Path:
    """Folder of a session's captures, and of a sphere under ambient light."""
    folder = tmp_path_factory.mktemp("session")
    for target, plan in plans.items():
        if target in REFERENCES or target.startswith(("board", "chrome")):
            capture_target(plan, virtual, "rig", target, SETTINGS["session"], folder / target)
    plan = ambient_plan(capture_plan(SETTINGS["plan"], virtual, "test"), SETTINGS["session"], "test")
    capture_material(plan, virtual, "rig", "gold", 25.0, folder / "gold", ambient=True)
    return folder


def manifests(session: Path, target: str) -> list[Path]:
    return sorted((session / target).glob("lights/*/manifest.json"))


@pytest.fixture(scope="module")
def documents(session: Path) -> Path:
    """Folder of the documents made from the session."""
    made = session / "documents"
    boards = {path.name: manifests(session, path.name)[0] for path in sorted(session.glob("board_*"))}
    calibrate_camera(boards, Board((9, 7), 5.0), made / "camera.json")
    references = {name: manifests(session, name)[0] for name in REFERENCES}
    calibrate_polarimeter(references, made / "polarimeter.json")
    chrome(session, made / "lights.json", ARM)
    ambient = manifests(session, "gold")[0]
    locate_sphere(ambient, made / "camera.json", 25.0, made / "sphere.json")
    return made


def chrome(session: Path, document: Path, arm: GivenRadius | None) -> None:
    made = session / "documents"
    calibrate_lights(
        manifests(session, "chrome"),
        manifests(session, "chrome_ambient")[0],
        made / "camera.json",
        made / "polarimeter.json",
        25.0,
        arm,
        document,
    )


def read(path: Path) -> dict[str, Any]:
    content: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return content


def test_camera_is_the_rigs_within_its_standard_errors(documents: Path) -> None:
    content = read(documents / "camera.json")
    assert content["source"] == "measured"
    errors = content["standard_errors"]
    off = np.subtract(content["focal_px"] + content["principal_px"], [3200, 3200, 95.2, 96.1])
    assert np.abs(off / (errors["focal_px"] + errors["principal_px"])).max() < 4
    assert max(errors["focal_px"]) < 0.002 * 3200
    assert (content["verdict"], content["boards_found"]) == ("good", 12)
    assert set(content["inputs"]) == {f"board_{view:02d}" for view in range(1, 13)}


def test_polarimeter_is_the_rigs_to_a_fiftieth_of_a_degree(documents: Path, virtual: RigSettings) -> None:
    content = read(documents / "polarimeter.json")
    assert content["usable"]
    assert (content["frame_rotation"]["by"], content["s3_sign"]["by"]) == ("LPH", "CPR")
    zeros = [content["zeros_deg"][name] for name in ELEMENTS]
    truth = [virtual["polarimeter"]["zeros_deg"][name] for name in ELEMENTS]
    np.testing.assert_allclose(zeros, truth, atol=1 / 50)
    calibration = PolarimeterCalibration.read(documents / "polarimeter.json")
    for nm in BANDS:
        found, true = calibration.at(nm, "test"), virtual_polarimeter(virtual, nm)
        off = (
            found.generator_retardance - true.generator_retardance,
            found.analyser_retardance - true.analyser_retardance,
        )
        assert np.rad2deg(np.abs(off)).max() < 1 / 50
    assert set(content["inputs"]) == set(REFERENCES)


def test_lights_stand_where_the_ball_sees_them(documents: Path, virtual: RigSettings) -> None:
    """Angles between lamp, ball and camera: a common turn of the camera's frame changes nothing."""
    content = read(documents / "lights.json")
    arm, true = read_lights(documents / "lights.json"), virtual_arm(virtual)
    ball = np.array(content["ball"]["centre_mm"])
    true_ball = np.asarray(true.centre_mm) + OFFSET_MM

    def theta_deg(light: Any, centre: Any) -> float:
        spoke = light - centre
        return float(np.rad2deg(np.arccos(-spoke @ centre / np.linalg.norm(spoke) / np.linalg.norm(centre))))

    for angle in LIGHTS:
        found = theta_deg(arm.light_position(angle), ball)
        assert found == pytest.approx(theta_deg(true.light_position(angle), true_ball), abs=0.1)
    worst = max(content["standard_errors"]["direction_deg"].values())
    assert worst < 0.25


def test_generator_is_upright_at_every_angle(documents: Path) -> None:
    arm = read_lights(documents / "lights.json")
    np.testing.assert_allclose(arm.generator_x(180.0), [0.0, -1.0, 0.0], atol=1e-12)
    for angle in LIGHTS:
        assert np.rad2deg(np.arccos(-arm.generator_x(angle)[1])) < 0.5


def test_an_angle_without_highlight_is_left_out_and_named(documents: Path) -> None:
    content = read(documents / "lights.json")
    assert "outline" in content["left_out"]["170.00"]
    assert set(content["left_out"]) | set(content["highlights_px"]) == {f"{a:06.2f}" for a in LIGHTS}


def test_an_angle_photographed_twice_is_refused(session: Path, documents: Path, tmp_path: Path) -> None:
    twice = manifests(session, "chrome")
    copy = tmp_path / "again" / twice[0].parent.name
    shutil.copytree(twice[0].parent, copy)
    with pytest.raises(InputError, match=r"20\.00°, and so is another photograph's") as refused:
        calibrate_lights(
            [*twice, copy / "manifest.json"],
            manifests(session, "chrome_ambient")[0],
            documents / "camera.json",
            documents / "polarimeter.json",
            25.0,
            ARM,
            tmp_path / "lights.json",
        )
    assert refused.value.source == str(copy / "manifest.json")
    assert not (tmp_path / "lights.json").exists()


def test_photographs_that_show_no_board_are_refused(session: Path, tmp_path: Path) -> None:
    balls = {path.parent.name: path for path in manifests(session, "chrome")}
    with pytest.raises(InputError, match=f"is found in 0 of {len(balls)} images"):
        calibrate_camera(balls, Board((9, 7), 5.0), tmp_path / "camera.json")
    assert not (tmp_path / "camera.json").exists()


def test_lights_without_the_arms_radius_are_unusable(session: Path, documents: Path, tmp_path: Path) -> None:
    """One ball tells directions; how far the lamps stand on them stays open."""
    chrome(session, tmp_path / "lights.json", None)
    with pytest.raises(InputError, match="unusable"):
        read_lights(tmp_path / "lights.json")


def test_sphere_is_seen_where_it_is(documents: Path) -> None:
    """At the place in the image, and as large: camera and distance err together."""
    camera = Camera.read(documents / "camera.json")
    found = Sphere.read(documents / "sphere.json")
    true_camera = Camera((3200.0, 3200.0), (95.2, 96.1), 192, 192)
    turn = np.linspace(0, 2 * np.pi, 36)
    seen = np.stack(camera.project(found.outline(turn)))
    true = np.stack(true_camera.project(Sphere((0.0, 0.0, 1000.0), 25.0).outline(turn)))
    assert np.abs(seen - true).max() < 0.06
    content = read(documents / "sphere.json")
    assert set(content["inputs"]) == {"ambient", "camera"}


def test_the_same_photographs_give_the_same_bytes(session: Path, documents: Path, tmp_path: Path) -> None:
    chrome(session, tmp_path / "lights.json", ARM)
    assert (tmp_path / "lights.json").read_bytes() == (documents / "lights.json").read_bytes()
    references = {name: manifests(session, name)[0] for name in REFERENCES}
    calibrate_polarimeter(references, tmp_path / "polarimeter.json")
    assert (tmp_path / "polarimeter.json").read_bytes() == (documents / "polarimeter.json").read_bytes()


def test_references_of_different_plans_are_refused(
    session: Path, virtual: RigSettings, plans: dict[str, CapturePlan], tmp_path: Path
) -> None:
    fewer = replace(plans["LPH"], bands_nm=(450,))
    capture_target(fewer, virtual, "rig", "LPH", SETTINGS["session"], tmp_path / "LPH")
    references = {"air": manifests(session, "air")[0], "LPH": manifests(tmp_path, "LPH")[0]}
    with pytest.raises(InputError) as refused:
        calibrate_polarimeter(references, tmp_path / "polarimeter.json")
    assert refused.value.field == "bands_nm"
    assert not (tmp_path / "polarimeter.json").exists()


def test_a_photograph_that_shows_no_sphere_is_named(session: Path, documents: Path, tmp_path: Path) -> None:
    board = manifests(session, "chrome")[0]
    with pytest.raises(InputError) as refused:
        locate_sphere(board, documents / "camera.json", 25.0, tmp_path / "sphere.json")
    assert refused.value.source == str(board)
    assert not (tmp_path / "sphere.json").exists()
