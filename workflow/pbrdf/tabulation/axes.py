"""Nodes of the table: θh quadratic, θd and φd linear."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pbrdf.formats.table_data import check_axis

Float = NDArray[np.float64]


@dataclass(frozen=True)
class Axes:
    """Node positions, radians; φd holds both −π and π. Raises `InputError` if an axis does not ascend."""

    theta_h: Float
    theta_d: Float
    phi_d: Float

    def __post_init__(self) -> None:
        for name in ("theta_h", "theta_d", "phi_d"):
            check_axis("nodes of the table", name, getattr(self, name))

    @property
    def shape(self) -> tuple[int, int, int]:
        """Numbers of nodes of θh, θd, φd."""
        return len(self.theta_h), len(self.theta_d), len(self.phi_d)


def table_axes(theta_h: int = 91, theta_d: int = 91, phi_d: int = 361) -> Axes:
    """Axes of the published tables for the default sizes.

    θh = (j / (n − 1))² · 90°. The supplement (SUPP §3) prints (j / 91)²; the published axes are
    (j / 90)² for 91 nodes.
    """
    half_turn = np.pi / 2
    return Axes(
        np.linspace(0.0, 1.0, theta_h) ** 2 * half_turn,
        np.linspace(0.0, half_turn, theta_d),
        np.linspace(-np.pi, np.pi, phi_d),
    )
