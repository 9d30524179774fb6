"""A sphere of a material in an environment, rendered by Mitsuba from the exported table."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from pbrdf.errors import InputError
from pbrdf.report.figures import Float, Picture, picture
from pbrdf.report.polarisation_colours import (
    chirality_colours,
    degree_colours,
    orientation_colours,
    type_colours,
)

SIDE = 160
SAMPLES = 64
_VARIANT = "scalar_spectral_polarized"
_COLUMNS = {
    "degree (DoP)": degree_colours,
    "orientation (AoLP)": orientation_colours,
    "chirality": chirality_colours,
    "type": type_colours,
}


def environment_render(table: str | Path, name: str, side: int = SIDE, samples: int = SAMPLES) -> Picture:
    """Render a sphere under a sky with a bright window, and draw its light's polarisation.

    Parameters
    ----------
    table : str or Path
        A ``.pbsdf`` without unknown nodes, which would be black.
    name : str
        The material, for the title.
    side, samples : int
        Pixels along the side, paths a pixel.

    Raises
    ------
    InputError
        If Mitsuba is not installed or cannot load the table.
    """
    if find_spec("mitsuba") is None:
        raise InputError("renders", "mitsuba", "is not installed", "pip install 'pbrdf[mitsuba]'")
    image = _rendered(Path(table), side, samples)
    rgb, stokes = _photograph(image[..., :3]), _stokes(image)
    tiles = {"photograph": rgb} | {title: colours(stokes) for title, colours in _COLUMNS.items()}

    def draw(figure: Figure) -> None:
        panels = figure.subplots(1, len(tiles))
        figure.subplots_adjust(left=0.005, right=0.995, top=0.78, bottom=0.01, wspace=0.03)
        figure.text(0.005, 0.98, f"{name} in an environment (Mitsuba)", va="top", weight="bold")
        for axes, (title, tile) in zip(panels, tiles.items(), strict=True):
            axes.imshow(np.round(255 * np.clip(tile, 0, 1)).astype(np.uint8), interpolation="none")
            axes.set_axis_off()
            axes.set_title(title, pad=2)

    alt = f"{name}: sphere under a sky with a bright window, rendered by Mitsuba from the table; "
    return picture(
        (9.4, 2.3), draw, alt + "photograph, degree, orientation, chirality, type of polarisation."
    )


def _rendered(table: Path, side: int, samples: int) -> Float:
    """Image of Mitsuba's Stokes integrator, (side, side, 15): colours, then S0 to S3 as red, green, blue."""
    import mitsuba

    mitsuba.set_variant(_VARIANT)
    try:
        scene = mitsuba.load_dict(_scene(mitsuba, table, side))
    except RuntimeError as error:
        problem = f"cannot be loaded by Mitsuba ({str(error).splitlines()[0]})"
        raise InputError(table, "file", problem, "export it again") from None
    return np.array(mitsuba.render(scene, spp=samples), dtype=np.float64)


def _scene(mitsuba: Any, table: Path, side: int) -> dict[str, Any]:
    looking = mitsuba.ScalarTransform4f().look_at(origin=[0, 0, 6], target=[0, 0, 0], up=[0, 1, 0])
    film = {"type": "hdrfilm", "width": side, "height": side, "rfilter": {"type": "box"}}
    return {
        "type": "scene",
        "integrator": {"type": "stokes", "integrator": {"type": "path", "max_depth": 4}},
        "sensor": {"type": "perspective", "fov": 20.5, "to_world": looking, "film": film},
        "sky": {"type": "envmap", "bitmap": mitsuba.Bitmap(_sky()), "scale": 1.0},
        "sphere": {"type": "sphere", "bsdf": {"type": "measured_polarized", "filename": str(table)}},
    }


def _sky(rows: int = 32) -> Any:
    """Radiance over zenith (rows) and azimuth: bright above, dark below, and a window of ten times that."""
    zenith = (np.arange(rows) + 0.5) / rows * np.pi
    grey = 0.15 + 0.85 * np.clip(np.cos(zenith), 0, 1)
    picture_of_sky = np.repeat(np.repeat(grey[:, None, None], 2 * rows, axis=1), 3, axis=2)
    picture_of_sky[rows // 4 : rows // 2, rows // 4 : rows // 2] = 10.0
    return np.ascontiguousarray(picture_of_sky, dtype=np.float32)


def _photograph(linear: Float) -> Float:
    white = float(np.percentile(linear, 99)) or 1.0
    shown = np.clip(linear / white, 0, 1)
    return np.where(shown <= 0.0031308, 12.92 * shown, 1.055 * shown ** (1 / 2.4) - 0.055)


def _stokes(image: Float) -> Float:
    """Stokes vectors of the green channel; unpolarised where there is no light."""
    stokes = np.stack([image[..., 3 + 3 * k + 1] for k in range(4)], axis=-1)
    dark = stokes[..., 0] <= 0
    stokes[dark] = [1.0, 0.0, 0.0, 0.0]
    return stokes
