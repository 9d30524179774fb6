"""A capture written from arrays: the open door for photographs from anywhere."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pbrdf.capture.frames import frame_indices, write_manifest
from pbrdf.capture.journal import Journal
from pbrdf.capture.run import light_folder, open_or_create
from pbrdf.errors import InputError
from pbrdf.formats.capture_store import FramesHeader, refuse_not_finite
from pbrdf.settings.plan import light_id


def write_capture(
    folder: str | Path,
    *,
    material: str,
    angle_deg: float,
    frames: Mapping[int, NDArray[Any]],
    states_deg: ArrayLike,
    exposures_s: Sequence[float],
    dark: NDArray[Any] | None = None,
    saturation: float | None = None,
    adc_bits: int | None = None,
    shift: int = 0,
    source: str = "arrays",
) -> Path:
    """Write the photographs of one light, so that the workflow runs on them as ``source: capture``.

    Parameters
    ----------
    folder : str or Path
        Folder of the material; the light goes to ``lights/<angle>`` in it. Call once a light.
    material : str
        Name of the material.
    angle_deg : float
        Angle of the arm: its position follows from the calibration of the lights. Degrees.
    frames : mapping of int to ndarray, shape (state, exposure, row, column)
        Raw frames by band centre in nm; uint8, uint16 or float32, all of one type and shape. DN.
    states_deg : array_like, shape (state, 4)
        Scale readings of generator polariser, generator retarder, analyser retarder and analyser
        polariser, degrees.
    exposures_s : sequence of float
        Exposure times, ascending, s.
    dark : ndarray, shape (exposure, repeat, row, column), optional
        Dark frames of the same type; without them the dark level is taken as zero.
    saturation : float, optional
        Values at or above it are saturated, DN. By default the largest value of an integer type;
        for float frames it must be given.
    adc_bits, shift : int, optional
        Bits of the converter and left alignment of its word; by default those of the type.
    source : str, optional
        Where the photographs come from, for the manifest.

    Returns
    -------
    Path
        The light's manifest.

    Raises
    ------
    InputError
        If shapes, types or values are not as described.

    Examples
    --------
    >>> write_capture("captures/jade", material="jade", angle_deg=41.0, frames={550: raw},
    ...               states_deg=states, exposures_s=[0.01, 0.08], dark=dark)  # doctest: +SKIP
    """
    header = _header(
        material, angle_deg, frames, states_deg, exposures_s, dark, saturation, adc_bits, shift, source
    )
    for band_nm, stack in frames.items():
        refuse_not_finite("write_capture", f"frames[{band_nm}]", stack)
    here = light_folder(folder, header.light)
    store = open_or_create(here / "frames.zarr", header)
    journal = Journal(here / "journal.jsonl")
    taken = journal.checksums()
    for index in frame_indices(header):
        if index.id in taken:
            continue
        if index.band_nm is None:
            assert dark is not None
            frame = dark[index.exposure, index.state]
            store.write_dark(index.exposure, index.state, frame)
        else:
            frame = frames[index.band_nm][index.state, index.exposure]
            store.write_frame(index.band_nm, index.state, index.exposure, frame)
        journal.append(index.id, frame, {})
    return write_manifest(here, header, journal.checksums())


def _header(
    material: str,
    angle_deg: float,
    frames: Mapping[int, NDArray[Any]],
    states_deg: ArrayLike,
    exposures_s: Sequence[float],
    dark: NDArray[Any] | None,
    saturation: float | None,
    adc_bits: int | None,
    shift: int,
    source: str,
) -> FramesHeader:
    states = np.asarray(states_deg, dtype=np.float64)
    if states.ndim != 2 or states.shape[1] != 4 or not np.all(np.isfinite(states)):
        raise _refused("states_deg", f"has shape {states.shape}", "give four finite angles a state")
    if not frames:
        raise _refused("frames", "holds no band", "give at least one band")
    first = next(iter(frames.values()))
    if first.ndim != 4 or first.shape[:2] != (len(states), len(exposures_s)):
        raise _refused(
            "frames", f"have shape {first.shape}", f"give ({len(states)}, {len(exposures_s)}, rows, columns)"
        )
    for band_nm, stack in frames.items():
        if stack.shape != first.shape or stack.dtype != first.dtype:
            raise _refused(
                f"frames[{band_nm}]",
                f"are {stack.dtype} {stack.shape}",
                f"make them {first.dtype} {first.shape}",
            )
    if dark is not None and (
        dark.ndim != 4 or dark.dtype != first.dtype or (dark.shape[0], *dark.shape[2:]) != first.shape[1:]
    ):
        raise _refused(
            "dark", f"is {dark.dtype} {dark.shape}", f"make it {first.dtype} (exposure, repeat, row, column)"
        )
    if any(b <= a for a, b in zip([0.0, *exposures_s], exposures_s, strict=False)):
        raise _refused("exposures_s", f"is {list(exposures_s)}", "give positive times in ascending order")
    whole_word = 8 * first.dtype.itemsize
    if saturation is None:
        if first.dtype.kind == "f":
            raise _refused(
                "saturation", "is not given for float frames", "say from which value on they saturate"
            )
        saturation = float(np.iinfo(first.dtype).max)
    return FramesHeader(
        material=material,
        light=light_id(angle_deg),
        source=source,
        angle_deg=float(angle_deg),
        bands_nm=tuple(sorted(frames)),
        states_deg=tuple(tuple(float(a) for a in state) for state in states),
        exposures_s=tuple(float(t) for t in exposures_s),
        darks=0 if dark is None else dark.shape[1],
        rows=first.shape[2],
        columns=first.shape[3],
        dtype=str(first.dtype),
        adc_bits=adc_bits or whole_word,
        shift=shift,
        saturation=saturation,
    )


def _refused(field: str, problem: str, remedy: str) -> InputError:
    return InputError("write_capture", field, problem, remedy)
