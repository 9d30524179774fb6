"""Carry out a plan: take what is missing, keep what is there."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from pbrdf.capture.frames import FrameIndex, frame_indices, position, write_manifest
from pbrdf.capture.journal import Journal
from pbrdf.capture.progress import Progress
from pbrdf.errors import InputError
from pbrdf.formats.capture_store import FramesHeader, FrameStore
from pbrdf.instruments.interface import Rig, Setting
from pbrdf.settings.plan import CapturePlan, Light


def capture(plan: CapturePlan, material: str, rig: Rig, folder: str | Path) -> list[Path]:
    """Photograph a material.

    Parameters
    ----------
    plan : CapturePlan
    material : str
        Its name.
    rig : Rig
        What takes the frames.
    folder : str or Path
        ``captures/<material>``; each light gets ``lights/<id>`` in it.

    Returns
    -------
    list of Path
        The manifests, one a light. Frames with a line in the journal are not taken again.

    Raises
    ------
    InputError
        If the plan contradicts frames already taken.
    """
    progress = Progress(f"capture of {material}", len(plan.lights) * plan.frames_per_light())
    return [_capture_light(plan, material, light, rig, Path(folder), progress) for light in plan.lights]


def light_folder(folder: str | Path, light: str) -> Path:
    """Folder of a light within a material's captures."""
    return Path(folder) / "lights" / light


def open_light(folder: Path, header: FramesHeader) -> tuple[FrameStore, Journal]:
    """Frame store and journal in a light's folder, begun if there are none.

    Raises
    ------
    InputError
        If frames of another kind lie there, or the journal speaks of frames that are gone.
    """
    path, journal = folder / "frames.zarr", Journal(folder / "journal.jsonl")
    if not path.exists():
        recorded = len(journal.checksums())
        if recorded:
            problem = f"records {recorded} frames, and {path.name} is gone"
            raise InputError(journal.path, "frames", problem, "restore it, or move the light's folder away")
        return FrameStore.create(path, header), journal
    store = FrameStore.open(path, writable=True)
    taken, wanted = store.header.attributes(), header.attributes()
    for name in wanted:
        if taken[name] != wanted[name]:
            field, before, now = _difference(name, taken[name], wanted[name])
            raise InputError(
                path,
                field,
                f"the frames there were taken with {before}, now it is {now}",
                "give the material another name, or move the folder away that it lies in",
            )
    return store, journal


def _capture_light(
    plan: CapturePlan, material: str, light: Light, rig: Rig, folder: Path, progress: Progress
) -> Path:
    form = rig.frame_format
    header = FramesHeader(
        material=material,
        light=light.id,
        source=rig.identity,
        angle_deg=light.angle_deg,
        bands_nm=plan.bands_nm,
        states_deg=plan.states_deg,
        exposures_s=plan.exposures_s,
        darks=plan.darks,
        rows=form.rows,
        columns=form.columns,
        dtype=form.dtype,
        adc_bits=form.adc_bits,
        shift=form.shift,
        saturation=form.saturation,
        references=plan.references,
        reference_state=plan.reference_state,
    )
    here = light_folder(folder, light.id)
    store, journal = open_light(here, header)
    taken = journal.checksums()
    for index in frame_indices(header):
        if index.id in taken and store.holds(*index[:3], reference=index.reference):
            progress.skip()
            continue
        frame, asked = _take(rig, light, header, index)
        store_frame(store, index, frame)
        journal.append(index.id, frame, {**asked, "taken_unix_s": round(time.time(), 3)})
        progress.step()
    return write_manifest(here, header, journal.checksums())


def _take(
    rig: Rig, light: Light, header: FramesHeader, index: FrameIndex
) -> tuple[NDArray[Any], dict[str, object]]:
    exposure_s = header.exposures_s[index.exposure]
    name = f"{light.id}/{index.id}"
    if index.band_nm is None:
        return rig.expose_dark(name, exposure_s), {"exposure_s": exposure_s}
    gp, gr, ar, ap = header.states_deg[header.reference_state if index.reference else index.state]
    setting = Setting(light, index.band_nm, (gp, gr, ar, ap), exposure_s, position(header, index))
    return rig.expose(name, setting), {"state_deg": [gp, gr, ar, ap], "exposure_s": exposure_s}


def store_frame(store: FrameStore, index: FrameIndex, frame: NDArray[Any]) -> None:
    """Store a frame at its place."""
    if index.band_nm is None:
        store.write_dark(index.exposure, index.state, frame)
    elif index.reference:
        store.write_reference(index.band_nm, index.state, index.exposure, frame)
    else:
        store.write_frame(index.band_nm, index.state, index.exposure, frame)


def _difference(field: str, taken: object, wanted: object) -> tuple[str, str, str]:
    """Field and both values, of lists of equal length the first entries that differ."""
    if isinstance(taken, list) and isinstance(wanted, list) and len(taken) == len(wanted):
        index = next(i for i, pair in enumerate(zip(taken, wanted, strict=True)) if pair[0] != pair[1])
        return f"{field}[{index}]", str(taken[index]), str(wanted[index])
    return field, _short(taken), _short(wanted)


def _short(value: object) -> str:
    text = str(value)
    if len(text) <= 60:
        return text
    return f"{text[:57]}… ({len(value)} entries)" if isinstance(value, list) else f"{text[:57]}…"
