"""A virtual rig whose arm's axis leans by two degrees: where the generator's axes point under every light."""

from __future__ import annotations

from copy import deepcopy
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from pbrdf.calibration.arm_problem import GivenRadius
from pbrdf.calibration.camera import KIND as CAMERA_KIND
from pbrdf.calibration.lights import read_lights
from pbrdf.calibration.polarimeter import PolarimeterCalibration
from pbrdf.calibration.session_lights import calibrate_lights
from pbrdf.calibration.session_polarimeter import calibrate_polarimeter
from pbrdf.capture.session import capture_target
from pbrdf.formats.documents import write_document
from pbrdf.instruments.virtual_geometry import virtual_arm
from pbrdf.optics.arm import Arm
from pbrdf.optics.frames import normalised, transverse
from pbrdf.settings.checked import check
from pbrdf.settings.plan import capture_plan
from pbrdf.settings.rig import RigSettings
from pbrdf.settings.targets import session_plans

LIGHTS = [20, 45, 70, 95, 120, 145]
REFERENCES = ("air", "LPH", "CPR")
TILT_DEG = (2.0, 1.5)


@pytest.fixture(scope="module")
def tilted(virtual: RigSettings) -> dict[str, Any]:
    rig = deepcopy(dict(virtual))
    rig["arm"]["axis_tilt_deg"] = list(TILT_DEG)
    return rig


@pytest.fixture(scope="module")
def documents(tilted: dict[str, Any], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of the polarimeter's and the lights' documents; the camera is given."""
    folder = tmp_path_factory.mktemp("tilted")
    plan = {
        "lights_deg": LIGHTS,
        "bands_nm": [550],
        "states": {"count": 36, "step_deg": 5, "ratio": 5},
        "exposures_ms": [5, 80],
        "references": 3,
    }
    settings = check({"materials": "materials.tsv", "plan": plan}, "config", "test")
    plans = session_plans(capture_plan(settings["plan"], tilted, "test"), settings, "test")
    for target in (*REFERENCES, "chrome", "chrome_ambient"):
        capture_target(plans[target], tilted, "rig", target, settings["session"], folder / target)
    camera = {name: tilted["camera"][name] for name in ("principal_px", "rows", "columns")}
    focal = [tilted["camera"]["focal_px"]] * 2
    write_document(folder / "camera.json", CAMERA_KIND, {**camera, "focal_px": focal})
    taken = {name: sorted((folder / name).glob("lights/*/manifest.json")) for name in plans}
    calibrate_polarimeter({name: taken[name][0] for name in REFERENCES}, folder / "polarimeter.json")
    calibrate_lights(
        taken["chrome"],
        taken["chrome_ambient"][0],
        folder / "camera.json",
        folder / "polarimeter.json",
        25.0,
        GivenRadius(803.0, 8.0),
        folder / "lights.json",
    )
    return folder


def polariser_axis(arm: Arm, angle_deg: float, zero: float) -> NDArray[np.float64]:
    """Direction (3,), camera's frame, of the generator polariser's axis where its scale reads zero."""
    beam = normalised(arm.centre_mm - arm.light_position(angle_deg))
    x = transverse(arm.generator_x(angle_deg), beam)
    axis: NDArray[np.float64] = np.cos(zero) * x + np.sin(zero) * np.cross(beam, x)
    return axis


def test_the_generators_axes_point_as_they_do_on_the_leaning_arm(
    tilted: dict[str, Any], documents: Path
) -> None:
    """Frame and zero come from different documents: together they must be the axis in space."""
    found = read_lights(documents / "lights.json")
    zero = PolarimeterCalibration.read(documents / "polarimeter.json").at(550, "test").zeros[0]
    true = virtual_arm(tilted)
    upright = Arm(found.centre_mm, (0.0, -1.0, 0.0), found.start, found.radius_mm, (0.0, -1.0, 0.0))
    true_zero = np.deg2rad(tilted["polarimeter"]["zeros_deg"]["generator_polariser"])

    def off_deg(arm: Arm, angle_deg: float) -> float:
        axes = polariser_axis(arm, angle_deg, zero), polariser_axis(true, angle_deg, true_zero)
        return float(np.rad2deg(np.arccos(np.clip(abs(axes[0] @ axes[1]), 0, 1))))

    errors = [off_deg(found, angle) for angle in LIGHTS]
    assert max(errors) < 0.05
    assert max(off_deg(upright, angle) for angle in LIGHTS) > 2
