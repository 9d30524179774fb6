"""A BSDF of Mitsuba 3 as a function of directions, in table frames."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pbrdf.errors import InputError
from pbrdf.optics.frames import angle_between, change_frames, normalised, table_axis

Float = NDArray[np.float64]

VARIANT = "scalar_spectral_polarized"
"""Runs wherever Mitsuba does: the vectorised variants need an LLVM or a graphics card."""

_NORMAL = (0.0, 0.0, 1.0)


class MitsubaBsdf:
    """An isotropic BSDF of Mitsuba's that scatters; what a perfect mirror reflects is not among its values.

    Parameters
    ----------
    description : mapping
        As `mitsuba.load_dict` takes it: ``type`` and the plugin's parameters.
    source : str or Path
        The file that holds the description, for messages.
    field : str
        Where in it, for messages.

    Raises
    ------
    InputError
        If Mitsuba is not installed, or makes no BSDF of the description.
    """

    def __init__(self, description: Mapping[str, Any], source: str | Path, field: str) -> None:
        with _mitsuba(source, field) as mi:
            try:
                self._bsdf = mi.load_dict(dict(description))
            # Mitsuba's loader raises whatever its plugins do: RuntimeError, TypeError, KeyError
            except Exception as error:
                words = " ".join(str(error).split())
                raise InputError(
                    source, field, f"is refused by Mitsuba ({words})", "correct the description"
                ) from None
            if not isinstance(self._bsdf, mi.BSDF):
                raise InputError(
                    source, field, f"is no BSDF but a {type(self._bsdf).__name__}", "give a BSDF's `type`"
                )
            self._vector, self._basis = mi.Vector3f, mi.mueller.stokes_basis
            self._context, self._surface = mi.BSDFContext(), mi.SurfaceInteraction3f()

    def evaluate(self, to_light: ArrayLike, to_camera: ArrayLike, wavelength_nm: float) -> Float:
        """Mueller matrices in 1/sr, table frames (`pbrdf.optics`), without the cosine.

        Parameters
        ----------
        to_light, to_camera : array_like, shape (n, 3)
            Unit vectors L and V above the horizon, z along the surface normal.
        wavelength_nm : float

        Returns
        -------
        ndarray, shape (n, 4, 4), float64
            As Mitsuba computes them, in float32. Where light and camera coincide, the frames are those
            of φd = 0.
        """
        light, camera = (np.asarray(a, dtype=np.float64) for a in (to_light, to_camera))
        values, x_in, x_out = np.empty((len(light), 4, 4)), np.empty(light.shape), np.empty(light.shape)
        surface = self._surface
        surface.wavelengths = [wavelength_nm] * 4
        for index, (towards, back) in enumerate(zip(light.tolist(), camera.tolist(), strict=True)):
            # light is traced from the camera: `wi` looks to the camera and `wo` to the light
            surface.wi, wo = self._vector(back), self._vector(towards)
            values[index] = self._bsdf.eval(self._context, surface, wo).numpy()[..., 0]
            x_in[index], x_out[index] = self._basis(-wo).numpy(), self._basis(surface.wi).numpy()
        axis = _table_axis(light, camera)
        turn_in, turn_out = angle_between(x_in, axis, -light), angle_between(x_out, axis, camera)
        return change_frames(values / light[:, 2, None, None], turn_in, turn_out)


def _table_axis(light: Float, camera: Float) -> Float:
    """``norm(L × V)``, and where that is undefined its limit at φd = 0, ``norm(n × h)``."""
    axis = table_axis(light, camera)
    for limit in (normalised(np.cross(_NORMAL, light + camera)), np.array([0.0, 1.0, 0.0])):
        axis = np.where(np.isnan(axis), limit, axis)
    return axis


@contextmanager
def _mitsuba(source: str | Path, field: str) -> Iterator[Any]:
    """Mitsuba in `VARIANT`; afterwards in the one that the caller had chosen."""
    try:
        import mitsuba
    except ImportError:
        remedy = "pip install 'pbrdf[mitsuba]'"
        raise InputError(source, field, "needs Mitsuba, which is not installed", remedy) from None
    before = mitsuba.variant()
    mitsuba.set_variant(VARIANT)
    try:
        yield mitsuba
    finally:
        if before is not None:
            mitsuba.set_variant(before)
