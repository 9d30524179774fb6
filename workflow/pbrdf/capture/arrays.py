"""A capture written from arrays: the open door for photographs from anywhere."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pbrdf.capture.frames import FrameIndex, frame_indices, write_manifest
from pbrdf.capture.journal import checksum
from pbrdf.capture.light_folder import light_folder, open_light
from pbrdf.errors import InputError
from pbrdf.formats.capture_store import DTYPES, FramesHeader, band_name, reference_name
from pbrdf.formats.frame_arrays import DARK, refuse_not_finite
from pbrdf.settings.materials import NAME, NAME_RULE
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
    references: Mapping[int, NDArray[Any]] | None = None,
    references_after: Sequence[int] = (),
    reference_state: int = 0,
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
    references : mapping of int to ndarray, shape (reference, exposure, row, column), optional
        Repeats of one state, of the same bands, shape and type as `frames`: they tell how the lamp
        drifts.
    references_after : sequence of int, optional
        How many states were taken before each repeat: ascending, from 0 to the number of states.
    reference_state : int, optional
        Which state is repeated.
    saturation : float, optional
        Values at or above it are saturated, DN. By default the largest word of `adc_bits` shifted by
        `shift`; for float frames it must be given.
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
        If shapes, types or values are not as described, or a frame is not the one written there before.

    Examples
    --------
    >>> write_capture("captures/jade", material="jade", angle_deg=41.0, frames={550: raw},
    ...               states_deg=states, exposures_s=[0.01, 0.08], dark=dark)  # doctest: +SKIP
    """
    header = _header(
        material, angle_deg, frames, states_deg, exposures_s, dark, saturation, adc_bits, shift, source
    )
    repeats = {} if references is None else references
    header = replace(
        header,
        references=_references(frames, repeats, references_after),
        reference_state=_reference_state(len(header.states_deg), references_after, reference_state),
    )
    for band_nm, stack in frames.items():
        refuse_not_finite("write_capture", band_name(band_nm), stack)
    for band_nm, stack in repeats.items():
        refuse_not_finite("write_capture", reference_name(band_nm), stack)
    if dark is not None:
        refuse_not_finite("write_capture", DARK, dark)
    here = light_folder(folder, header.light)
    store, journal = open_light(here, header)
    taken = journal.checksums()
    given = {index: _frame(index, frames, repeats, dark) for index in frame_indices(header)}
    for index, frame in given.items():
        if index.id in taken and checksum(frame) != taken[index.id]:
            raise InputError(
                here,
                index.id,
                "contradicts the frame written there before",
                "write to another folder, or move the light's folder away",
            )
    for index, frame in given.items():
        if index.id in taken:
            continue
        store.write_at(*index.place, frame)
        journal.append(index.id, frame, {})
    return write_manifest(here, header, journal.checksums())


def _frame(
    index: FrameIndex,
    frames: Mapping[int, NDArray[Any]],
    references: Mapping[int, NDArray[Any]],
    dark: NDArray[Any] | None,
) -> NDArray[Any]:
    if index.band_nm is not None:
        stack = (references if index.reference else frames)[index.band_nm]
        frame: NDArray[Any] = stack[index.state, index.exposure]
        return frame
    assert dark is not None
    covered: NDArray[Any] = dark[index.exposure, index.state]
    return covered


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
    if not NAME.fullmatch(material):
        raise _refused("material", f"is {material!r}", NAME_RULE)
    if not 0.0 <= angle_deg <= 360.0:
        raise _refused("angle_deg", f"is {angle_deg}", "give the arm's angle within 0…360°")
    states = _states(states_deg)
    if not len(exposures_s) or not all(a < b < np.inf for a, b in pairwise([0.0, *exposures_s])):
        raise _refused("exposures_s", f"is {list(exposures_s)}", "give positive times in ascending order")
    form = _form(frames, (len(states), len(exposures_s)))
    if dark is not None and (
        dark.ndim != 4 or dark.dtype != form.dtype or (dark.shape[0], *dark.shape[2:]) != form.shape[1:]
    ):
        raise _refused(
            "dark", f"is {dark.dtype} {dark.shape}", f"make it {form.dtype} (exposure, repeat, row, column)"
        )
    whole_word = 8 * form.dtype.itemsize
    bits = whole_word if adc_bits is None else adc_bits
    if shift < 0 or not 0 < bits <= whole_word - shift:
        raise _refused(
            "adc_bits",
            f"{bits} shifted by {shift} are no part of {whole_word}",
            "correct `adc_bits` or `shift`",
        )
    if saturation is None:
        if form.dtype.kind == "f":
            raise _refused(
                "saturation", "is not given for float frames", "say from which value on they saturate"
            )
        saturation = float(((1 << bits) - 1) << shift)
    if not 0.0 < saturation < np.inf:
        raise _refused("saturation", f"is {saturation}", "give a positive, finite value")
    return FramesHeader(
        material=material,
        light=light_id(angle_deg),
        source=source,
        angle_deg=float(angle_deg),
        bands_nm=tuple(sorted(frames)),
        states_deg=tuple(tuple(float(a) for a in state) for state in states),
        exposures_s=tuple(float(t) for t in exposures_s),
        darks=0 if dark is None else dark.shape[1],
        rows=form.shape[2],
        columns=form.shape[3],
        dtype=str(form.dtype),
        adc_bits=bits,
        shift=shift,
        saturation=float(saturation),
    )


def _references(
    frames: Mapping[int, NDArray[Any]], references: Mapping[int, NDArray[Any]], after: Sequence[int]
) -> tuple[int, ...]:
    """Places of the repeats of frames that are as they should be."""
    form = next(iter(frames.values()))
    states = form.shape[0]
    whole = all(isinstance(before, int) and not isinstance(before, bool) for before in after)
    if not whole or any(b <= a for a, b in pairwise([-1, *after, states + 1])):
        raise _refused(
            "references_after",
            f"is {list(after)} with {states} states",
            f"give whole numbers from 0 to {states} in ascending order",
        )
    if after or references:
        wanted = (len(after), *form.shape[1:])
        if references.keys() != frames.keys():
            problem = f"has the bands {sorted(references)} where the frames have {sorted(frames)}"
            raise _refused("references", problem, "repeat the same state in every band")
        for band_nm, stack in references.items():
            if stack.shape != wanted or stack.dtype != form.dtype:
                problem = f"are {stack.dtype} {stack.shape}"
                raise _refused(f"references[{band_nm}]", problem, f"make them {form.dtype} {wanted}")
    return tuple(after)


def _reference_state(states: int, after: Sequence[int], state: int) -> int:
    """Number of the state that is repeated, if there is one of that number; zero without repeats."""
    whole = isinstance(state, int) and not isinstance(state, bool)
    if not whole or not 0 <= state < (states if after else 1):
        problem = f"is {state!r} with {states} states and {len(after)} repeats"
        raise _refused("reference_state", problem, "number the state that `references` show, from 0")
    return state


def _states(states_deg: ArrayLike) -> NDArray[np.float64]:
    try:
        states = np.asarray(states_deg, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise _refused("states_deg", f"is no array ({error})", "give four angles a state") from None
    if states.ndim != 2 or states.shape[1] != 4 or not len(states):
        raise _refused("states_deg", f"has shape {states.shape}", "give four angles a state")
    if not np.all(np.isfinite(states)):
        first = int(np.argwhere(~np.isfinite(states))[0][0])
        raise _refused(f"states_deg[{first}]", f"is {states[first].tolist()}", "give finite angles")
    return states


def _form(frames: Mapping[int, NDArray[Any]], first_axes: tuple[int, int]) -> NDArray[Any]:
    """One band's frames, for the shape and type that all of them have."""
    if not frames:
        raise _refused("frames", "holds no band", "give at least one band")
    form = next(iter(frames.values()))
    for band_nm, stack in frames.items():
        field = f"frames[{band_nm!r}]"
        if isinstance(band_nm, bool) or not isinstance(band_nm, int) or band_nm <= 0:
            raise _refused(field, "is not a wavelength", "name bands by whole nm")
        if str(stack.dtype) not in DTYPES:
            raise _refused(field, f"are {stack.dtype}", f"convert the frames to {', '.join(DTYPES)}")
        if stack.ndim != 4 or stack.shape[:2] != first_axes or 0 in stack.shape:
            wanted = f"({first_axes[0]}, {first_axes[1]}, rows, columns)"
            raise _refused(field, f"have shape {stack.shape}", f"give {wanted}")
        if stack.shape != form.shape or stack.dtype != form.dtype:
            raise _refused(field, f"are {stack.dtype} {stack.shape}", f"make them {form.dtype} {form.shape}")
    return form


def _refused(field: str, problem: str, remedy: str) -> InputError:
    return InputError("write_capture", field, problem, remedy)
