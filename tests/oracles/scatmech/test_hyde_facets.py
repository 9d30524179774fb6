"""The facet term of Hyde's model is that of NIST's SCATMECH with Torrance and Sparrow's shadowing."""

from __future__ import annotations

import json
import os
import subprocess
from pathlib import Path

import numpy as np
import pytest

from pbrdf.models import MODELS
from pbrdf.optics.frames import angle_between, change_frames, normalised, table_axis

HERE = Path(__file__).parent
PYTHON = Path(os.environ.get("PBRDF_ORACLES", HERE.parents[2] / ".venv-oracles" / "bin" / "python"))
NORMAL = np.array([0.0, 0.0, 1.0])
SIGNS = np.diag([1.0, 1.0, 1.0, -1.0])
"""From SCATMECH's Stokes vectors to ours: its fourth component counts the other handedness."""


def installed() -> bool:
    return PYTHON.exists() and any(PYTHON.parents[1].glob("lib/python*/site-packages/pySCATMECH/__init__.py"))


def scatmech(angles: np.ndarray, **parameters: float) -> np.ndarray:
    asked = json.dumps({"angles": angles.tolist(), **parameters})
    done = subprocess.run(
        [PYTHON, "-W", "ignore", HERE / "session_facet.py"], input=asked, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    return np.array(json.loads(done.stdout))


@pytest.mark.skipif(not installed(), reason=f"pySCATMECH is not at {PYTHON}: `make scatmech` installs it")
@pytest.mark.parametrize("sigma", [0.1, 0.5])
@pytest.mark.parametrize(("eta", "kappa"), [(1.5, 0.0), (0.35, 2.7), (3.1, 3.3)])
def test_facets_of_hyde_are_scatmechs_in_all_sixteen_elements(sigma: float, eta: float, kappa: float) -> None:
    random = np.random.default_rng(4)
    theta_i, theta_s = np.arccos(random.uniform(0.05, 1.0, (2, 2000)))
    phi_s = random.uniform(-np.pi, np.pi, 2000)
    theirs = scatmech(np.stack([theta_i, theta_s, phi_s], axis=-1), sigma=sigma, eta=eta, kappa=kappa)

    light = np.stack([-np.sin(theta_i), 0 * theta_i, np.cos(theta_i)], axis=-1)
    camera = np.stack(
        [np.sin(theta_s) * np.cos(phi_s), np.sin(theta_s) * np.sin(phi_s), np.cos(theta_s)], axis=-1
    )
    parameters = {"sigma": sigma, "eta": eta, "kappa": kappa, "specular": 1.0, "albedo": 0.0}
    ours = MODELS["hyde2009_complex"].evaluate(light, camera, parameters)
    # theirs is in the s-axes of the macroscopic surface
    axis = table_axis(light, camera)
    angle_in = angle_between(axis, normalised(np.cross(NORMAL, -light)), -light)
    angle_out = angle_between(axis, normalised(np.cross(NORMAL, camera)), camera)
    ours = change_frames(ours, angle_in, angle_out)
    theirs = SIGNS @ theirs @ SIGNS
    scale = np.maximum(ours[:, 0, 0], 1e-6 * ours[:, 0, 0].max())
    assert np.max(np.abs(ours - theirs).max(axis=(1, 2)) / scale) < 1e-5
