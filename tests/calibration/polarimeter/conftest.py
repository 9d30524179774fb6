"""Signals of known polarimeters."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import pytest
from numpy.typing import NDArray

from pbrdf.calibration.polarimeter_signal import Reference
from pbrdf.optics.polarimeter import Polarimeter


@pytest.fixture(scope="session")
def slow_and_fast_deg() -> NDArray[np.float64]:
    """States (36, 4), degrees: retarders over half a turn as one to five, polarisers parallel."""
    slow = 5.0 * np.arange(36)
    return np.stack([0 * slow, slow, 5 * slow, 0 * slow], axis=-1)


@pytest.fixture(scope="session")
def signals() -> Callable[..., NDArray[np.float64]]:
    """Signals (references, bands, states) of polarimeters, a lamp of 1000 that drifts."""

    def seen(
        polarimeters: Sequence[Polarimeter],
        states_deg: NDArray[np.float64],
        references: Sequence[Reference],
        drift: float = 0.0,
    ) -> NDArray[np.float64]:
        lamp = 1000.0 * (1.0 + drift * np.linspace(-0.5, 0.5, len(states_deg)))
        matrices = [p.measurement_matrix(np.deg2rad(states_deg)) for p in polarimeters]
        return np.stack([[lamp * (w @ r.mueller.ravel()) for w in matrices] for r in references])

    return seen
