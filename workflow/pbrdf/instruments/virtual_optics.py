"""What the sphere of a virtual rig is made of: a facet model, a table, or a BSDF of Mitsuba's."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from pbrdf._kernels import render
from pbrdf.formats.receipt import digest
from pbrdf.instruments.virtual_geometry import UP
from pbrdf.instruments.virtual_surface import LitSphere, traced_image
from pbrdf.instruments.virtual_view import Float
from pbrdf.models import MODELS
from pbrdf.models.mitsuba_bsdf import MitsubaBsdf
from pbrdf.models.table import open_table
from pbrdf.settings.rig import is_by_band, sphere_files

_RINGS = 64
"""Of the hemisphere, over which reflectance is summed."""


class Optics(Protocol):
    """A sphere's surface."""

    @property
    def truth(self) -> Any:
        """All that its images depend on, as JSON holds it."""

    def evaluate(self, to_light: Float, to_camera: Float, band_nm: int) -> Float:
        """Mueller matrices (n, 4, 4) in table frames, 1/sr, of unit vectors (n, 3); NaN where unknown."""

    def mueller_image(self, rig: dict[str, Any], scene: LitSphere, band_nm: int) -> NDArray[np.float32]:
        """Mueller image (rows, columns, 16) of the light path (`traced_image`)."""

    def reflectance(self, band_nm: int) -> tuple[float, float]:
        """Diffuse albedo, and reflectance of a mirror: how it looks under ambient light."""


class Facets:
    """The facet model of a rig's file, rendered by a kernel (`Optics`)."""

    model, width = "baek2018_complex", "alpha"

    def __init__(self, sphere: dict[str, Any]) -> None:
        self._sphere = sphere

    @property
    def truth(self) -> dict[str, Any]:
        """As the file tells it."""
        return self._sphere

    def evaluate(self, to_light: Float, to_camera: Float, band_nm: int) -> Float:
        """See `Optics`."""
        optics = self._sphere["bands"][str(band_nm)]
        parameters = {
            self.width: self._sphere["roughness"],
            "eta": optics["index"],
            "kappa": optics.get("extinction", 0.0),
            "specular": optics["specular"],
            "albedo": optics["albedo"],
        }
        return MODELS[self.model].evaluate(to_light, to_camera, parameters)

    def mueller_image(self, rig: dict[str, Any], scene: LitSphere, band_nm: int) -> NDArray[np.float32]:
        """See `Optics`."""
        camera, optics = rig["camera"], self._sphere["bands"][str(band_nm)]
        focal, (cx, cy) = camera["focal_px"], camera["principal_px"]
        material = (
            self._sphere["roughness"],
            optics["index"],
            optics.get("extinction", 0.0),
            optics["specular"],
            optics["albedo"],
        )
        image: NDArray[np.float32] = render.render_mueller(
            render.Pinhole(focal, focal, cx, cy),
            render.SphereScene(
                centre=scene.centre,
                radius=scene.radius,
                light=scene.light,
                generator_axis=scene.generator_x,
                analyser_axis=np.array(UP),
            ),
            material,
            camera["rows"],
            camera["columns"],
            rig["samples"],
        )
        return image

    def reflectance(self, band_nm: int) -> tuple[float, float]:
        """Its albedo, and what Fresnel's equations give at normal incidence."""
        optics = self._sphere["bands"][str(band_nm)]
        index, square = optics["index"], optics.get("extinction", 0.0) ** 2
        return optics["albedo"], ((index - 1) ** 2 + square) / ((index + 1) ** 2 + square)


class GaussianFacets(Facets):
    """Hyde's model with the indices of a rig's file, evaluated where each ray meets the sphere (`Optics`)."""

    model, width = "hyde2009_complex", "sigma"

    def mueller_image(self, rig: dict[str, Any], scene: LitSphere, band_nm: int) -> NDArray[np.float32]:
        """See `Optics`."""
        return traced_image(rig, scene, lambda light, camera: self.evaluate(light, camera, band_nm))


class Sampled:
    """A table or BSDFs of Mitsuba's, evaluated where each ray meets the sphere (`Optics`).

    Parameters
    ----------
    sphere : dict
        The sphere's part of the rig's file, with `table` or `mitsuba`.
    source : str or Path
        That file, for messages.
    field : str
        Where in it the sphere stands.

    Raises
    ------
    InputError
        If the table cannot be read, Mitsuba is not installed or refuses the description.
    """

    def __init__(self, sphere: dict[str, Any], source: str | Path, field: str) -> None:
        self._sphere, self._source, self._field = sphere, source, field
        self._table = open_table(sphere["table"]) if "table" in sphere else None
        self._bsdf = lru_cache(self._loaded_bsdf)
        self.truth = _told_by_content(sphere)

    def evaluate(self, to_light: Float, to_camera: Float, band_nm: int) -> Float:
        """See `Optics`."""
        if self._table is not None:
            return self._table.evaluate(to_light, to_camera, band_nm)
        return self._bsdf(band_nm).evaluate(to_light, to_camera, band_nm)

    def mueller_image(self, rig: dict[str, Any], scene: LitSphere, band_nm: int) -> NDArray[np.float32]:
        """See `Optics`."""
        return traced_image(rig, scene, lambda light, camera: self.evaluate(light, camera, band_nm))

    def reflectance(self, band_nm: int) -> tuple[float, float]:
        """All that it reflects of light from the normal, taken for diffuse."""
        angle = (np.arange(_RINGS) + 0.5) / _RINGS * np.pi / 2
        around = np.stack([np.sin(angle), np.zeros(_RINGS), np.cos(angle)], axis=-1)
        normal = np.broadcast_to((0.0, 0.0, 1.0), around.shape)
        m00 = np.nan_to_num(self.evaluate(normal, around, band_nm)[:, 0, 0])
        share = np.pi * np.sum(m00 * np.sin(2 * angle)) * (np.pi / 2 / _RINGS)
        return float(np.clip(share, 0.0, 1.0)), 0.0

    def _loaded_bsdf(self, band_nm: int) -> MitsubaBsdf:
        told = self._sphere["mitsuba"]
        if is_by_band(told):
            return MitsubaBsdf(told[str(band_nm)], self._source, f"{self._field}.mitsuba.{band_nm}")
        return MitsubaBsdf(told, self._source, f"{self._field}.mitsuba")


def optics_of(sphere: dict[str, Any], source: str | Path, field: str) -> Optics:
    """Surface of a sphere of a rig's file; parameters and errors as those of `Sampled`."""
    if "model" in sphere:
        return (GaussianFacets if sphere["model"] == "hyde2009" else Facets)(sphere)
    return Sampled(sphere, source, field)


def _told_by_content(sphere: dict[str, Any]) -> dict[str, Any]:
    """The sphere's part of the file, with what its files hold instead of where they lie."""
    held = {path: digest([path]) for path in sphere_files(sphere) if Path(path).exists()}

    def told(part: Any) -> Any:
        if isinstance(part, dict):
            return {name: told(value) for name, value in part.items()}
        return held.get(part, part) if isinstance(part, str) else part

    content: dict[str, Any] = told(sphere)
    return content
