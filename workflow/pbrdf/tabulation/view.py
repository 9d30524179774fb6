"""Who looks from where at what, and what is seen."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pbrdf.calibration.camera import Camera
from pbrdf.calibration.sphere import Sphere
from pbrdf.optics.arm import Arm, Vector
from pbrdf.reconstruction.noise import NoiseModel


@dataclass(frozen=True)
class Viewpoint:
    """Everything geometric about one light."""

    camera: Camera
    sphere: Sphere
    arm: Arm
    angle_deg: float
    analyser_axis: Vector

    @property
    def light_mm(self) -> NDArray[np.float64]:
        """Position of the light, shape (3,), mm, camera frame."""
        return self.arm.light_position(self.angle_deg)


@dataclass(frozen=True)
class BandImage:
    """Mueller image of a band (`pbrdf.formats.mueller_exr`), its noise, and what turns DN/s into 1/sr."""

    mueller: NDArray[np.float32]
    variance: NDArray[np.float32]
    first: tuple[int, int]
    noise: NoiseModel
    scale: float
