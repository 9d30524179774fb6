"""A small table whose truth is a model: every figure on its page can be checked."""

from __future__ import annotations

import numpy as np
import pytest

from pbrdf.fitting import FitResult, fit
from pbrdf.formats.table_data import Origin, TableData
from pbrdf.models import MODELS
from pbrdf.optics.rusinkiewicz import cosines, directions


@pytest.fixture(scope="session")
def table() -> TableData:
    """Two bands on a coarse grid, a tenth of the nodes inpainted, the grazing ones unseen."""
    theta_h = np.linspace(0, 1, 11) ** 2 * np.pi / 2
    theta_d = np.radians(np.arange(0, 91, 10.0))
    phi_d = np.radians(np.arange(-180, 181, 15.0))
    grid = np.meshgrid(theta_h, theta_d, phi_d, indexing="ij")
    light, camera = directions(grid[0], np.maximum(grid[1], 1e-6), grid[2])
    bands = [
        MODELS["baek2018"].evaluate(
            light, camera, {"alpha": 0.2, "eta": 1.5, "specular": 0.8, "albedo": albedo}
        )
        for albedo in (0.3, 0.5)
    ]
    random = np.random.default_rng(1)
    mueller = np.stack(bands) * random.normal(1.0, 0.02, (2, *grid[0].shape, 1, 1))
    cos_i, cos_o = cosines(*grid)
    origin = np.full((2, *grid[0].shape), Origin.MEASURED, dtype=np.uint8)
    origin[random.uniform(size=origin.shape) < 0.1] = Origin.INPAINTED
    origin[:, np.minimum(cos_i, cos_o) < 0.1] = Origin.UNSEEN
    origin[:, np.minimum(cos_i, cos_o) < 1e-6] = Origin.NEVER_VISIBLE
    mueller[np.isin(origin, (Origin.UNSEEN, Origin.NEVER_VISIBLE))] = np.nan
    count = np.where(origin == Origin.MEASURED, 3, 0).astype(np.uint16)
    return TableData(
        "synthetic.zarr",
        np.array([450.0, 550.0]),
        theta_h,
        theta_d,
        phi_d,
        mueller.astype(np.float32),
        count=count,
        origin=origin,
    )


@pytest.fixture(scope="session")
def fitted(table: TableData) -> FitResult:
    return fit(table, downsample=1, starts=1)
