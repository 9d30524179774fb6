"""A measured table (KAIST Spectralon, subsampled) whose file does not say where its nodes lie."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from pbrdf.errors import InputError
from pbrdf.models.table import Table, open_table
from pbrdf.optics.rusinkiewicz import cosines

AXES = {
    "phi_d": np.radians(-180.0 + 17.0 * np.arange(22)),
    "theta_d": np.radians(11.0 * np.arange(9)),
    "theta_h": np.radians((11.0 * np.arange(9) / 90.0) ** 2 * 90.0),
}
# Pauli matrices in the order of the Stokes parameters
PAULI = np.array([[[1, 0], [0, 1]], [[1, 0], [0, -1]], [[0, 1], [1, 0]], [[0, -1j], [1j, 0]]])


@pytest.fixture
def file(real_data: Path) -> Path:
    return real_data / "spectralon" / "spectralon_lowres.pbsdf"


@pytest.fixture
def spectralon(file: Path) -> Table:
    return open_table(file, AXES)


def least_eigenvalues(mueller: NDArray[np.float64]) -> NDArray[np.float64]:
    """Least eigenvalue of Cloude's matrix ``¼ Σ Mij σi ⊗ σj*`` (Cloude 1986)."""
    basis = np.einsum("iab,jcd->ijacbd", PAULI, PAULI.conj()).reshape(4, 4, 4, 4)
    coherency = np.einsum("...ij,ijkl->...kl", mueller, basis) / 4
    least: NDArray[np.float64] = np.linalg.eigvalsh(coherency)[..., 0]
    return least


def above_the_horizon(table: Table) -> NDArray[np.bool_]:
    """Nodes (B, H, D, P) whose light and camera are both above the horizon."""
    data = table.data
    theta_h, theta_d, phi_d = np.meshgrid(data.theta_h, data.theta_d, data.phi_d, indexing="ij")
    cos_light, cos_camera = cosines(theta_h, theta_d, phi_d)
    return np.broadcast_to((cos_light > 0) & (cos_camera > 0), data.mueller.shape[:4])


def test_the_file_alone_is_refused(file: Path) -> None:
    with pytest.raises(InputError) as caught:
        open_table(file)
    assert caught.value.field == "theta_h"
    assert "--axes FILE.yaml" in caught.value.remedy


def test_retro_reflection_is_as_read_from_the_file_elsewhere(spectralon: Table) -> None:
    # where light and camera coincide φd means nothing: the nodes along it are repeats of one measurement
    along_phi_d = spectralon.data.mueller[2, :, 0, :, 0, 0].astype(np.float64)
    tilt = np.degrees(spectralon.data.theta_h)
    assert tilt[[0, 5, 6, 7]] == pytest.approx([0.0, 33.6, 48.4, 65.9], abs=0.05)
    assert along_phi_d.mean(axis=1)[[0, 5, 6, 7]] == pytest.approx([0.2178, 0.1698, 0.1475, 0.132], abs=5e-4)
    normal = [0.0, 0.0, 1.0]
    repeats = along_phi_d[0]
    assert repeats.min() <= spectralon.evaluate(normal, normal, 550.0)[0, 0] <= repeats.max()
    assert repeats == pytest.approx(0.218, abs=1e-3)


def test_most_valid_nodes_are_physical(spectralon: Table) -> None:
    known = above_the_horizon(spectralon) & spectralon.data.mueller.any(axis=(-1, -2))
    mueller = spectralon.data.mueller[known].astype(np.float64)
    physical = least_eigenvalues(mueller) >= -1e-9 * mueller[..., 0, 0]
    assert physical.mean() == pytest.approx(0.885, abs=5e-4)


def test_nodes_below_the_horizon_hold_zeros(spectralon: Table) -> None:
    below = ~above_the_horizon(spectralon)
    assert 0.2 < below.mean() < 0.3
    assert not spectralon.data.mueller[below].any()
