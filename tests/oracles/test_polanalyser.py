"""Our elements and reconstruction equal polanalyser's."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

from pbrdf.calibration.polarimeter import PolarimeterCalibration
from pbrdf.capture.images import import_images, read_image_settings
from pbrdf.formats.capture_store import FrameStore
from pbrdf.optics.mueller import linear_polariser, linear_retarder, rotator
from pbrdf.optics.polarimeter import Polarimeter
from pbrdf.reconstruction.mueller_image import reconstruct
from pbrdf.reconstruction.reduction import data_reduction

pa = pytest.importorskip("polanalyser", reason="polanalyser is not installed: pip install polanalyser")

ROOT = Path(__file__).resolve().parents[2]
ANGLES = np.random.default_rng(1).uniform(-np.pi, np.pi, 40)


def test_polarisers_are_the_same() -> None:
    for angle in ANGLES:
        np.testing.assert_allclose(pa.polarizer(angle), linear_polariser(angle), atol=1e-14)


def test_retarders_are_the_same() -> None:
    for angle in ANGLES:
        np.testing.assert_allclose(pa.qwp(angle), linear_retarder(np.pi / 2, angle), atol=1e-14)
        np.testing.assert_allclose(pa.retarder(0.8, angle), linear_retarder(0.8, angle), atol=1e-14)


def test_rotators_are_the_same() -> None:
    for angle in ANGLES:
        np.testing.assert_allclose(pa.rotator(angle), rotator(angle), atol=1e-14)


def test_reconstruction_is_the_same() -> None:
    """The layout of polanalyser's example: crossed polarisers, the generator's retarder the fast one."""
    angle = np.linspace(0, np.pi, 36, endpoint=False)
    mueller = np.random.default_rng(2).uniform(-1, 1, size=(5, 4, 4))
    generator = [pa.qwp(5 * a) @ pa.polarizer(0) for a in angle]
    analyser = [pa.polarizer(np.pi / 2) @ pa.qwp(a) for a in angle]
    intensity = np.array([(a @ mueller @ g)[..., 0, 0] for a, g in zip(analyser, generator, strict=True)])

    states = np.rad2deg(np.stack([0 * angle, 5 * angle, angle, 0 * angle + np.pi / 2], axis=-1))
    solution = data_reduction(Polarimeter(np.pi / 2, np.pi / 2), states, "example")
    np.testing.assert_allclose(solution.measurement @ mueller.reshape(5, 16).T, intensity, atol=1e-14)
    found = (solution.reduction @ intensity).T.reshape(5, 4, 4)
    np.testing.assert_allclose(found, pa.calcMueller(intensity, generator, analyser), atol=1e-12)


@pytest.mark.parametrize("axis", ["fast", "slow"])
def test_the_mueller_image_of_metal_objects_is_the_same(real_data: Path, tmp_path: Path, axis: str) -> None:
    """Every pixel, to what float32 can hold.

    Retarder angles that count from the slow axis reverse s3 on both sides of the sample, which is how
    the authors' matrices differ from ours: they are S M S with S = diag(1, 1, 1, −1).
    """
    images, details = real_data / "metal-objects/630", ROOT / "config/real/metal_objects.csv"
    polarimeter = PolarimeterCalibration.read(ROOT / "config/real/polarimeter.json").at(630, details)
    manifest = import_images(images, details, "000.00", "metal_objects", tmp_path)
    store = FrameStore.open(manifest.parent / "frames.zarr")
    ours = reconstruct(store, 630, polarimeter, None, (slice(0, 480), slice(0, 640))).mueller

    settings = read_image_settings(details)
    intensity = np.stack([cv2.imread(str(images / s.file), cv2.IMREAD_UNCHANGED) for s in settings])
    turn, flip = (np.pi / 2, np.diag([1, 1, 1, -1])) if axis == "slow" else (0.0, np.eye(4))
    generator, analyser = [], []
    for gp, gr, ar, ap in np.deg2rad([s.state_deg for s in settings]):
        generator.append(pa.retarder(polarimeter.generator_retardance, gr + turn) @ pa.polarizer(gp))
        analyser.append(pa.polarizer(ap) @ pa.retarder(polarimeter.analyser_retardance, ar + turn))
    theirs = flip @ pa.calcMueller(intensity, generator, analyser) @ flip

    difference = np.abs(np.moveaxis(ours, 0, -1).reshape(theirs.shape) - theirs)
    relative = difference.max(axis=(-2, -1)) / theirs[..., 0, 0]
    assert relative.max() < 1e-6
