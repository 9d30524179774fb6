"""Carry out a plan: take what is missing, keep what is there."""

from __future__ import annotations

import errno
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from pbrdf.capture.frames import MANIFEST_FILE, FrameIndex, frame_indices, position, write_manifest
from pbrdf.capture.interruption import Interrupted, interruptible, sole_owner
from pbrdf.capture.light_folder import light_folder, open_light, whole_frames
from pbrdf.capture.progress import Progress
from pbrdf.errors import InputError
from pbrdf.formats.capture_store import FramesHeader
from pbrdf.instruments.interface import Rig, Setting, Taken
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
        The manifests, one a light. Frames with a line in the journal are not taken again; those of a light
        that is not whole are held against their checksums first.

    Raises
    ------
    InputError
        If the plan contradicts frames already taken, the disk is full, another capture is at work in the
        folder, or the user asked for an end (`Interrupted`).
    InstrumentError
        If an instrument does not do what it should.
    """
    progress = Progress(f"capture of {material}", len(plan.lights) * plan.frames_per_light())
    with sole_owner(Path(folder)), interruptible() as ended:
        return [
            _capture_light(_header(plan, material, light, rig), rig, Path(folder), progress, ended)
            for light in plan.lights
        ]


def _header(plan: CapturePlan, material: str, light: Light, rig: Rig) -> FramesHeader:
    form = rig.frame_format
    return FramesHeader(
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


def _capture_light(
    header: FramesHeader,
    rig: Rig,
    folder: Path,
    progress: Progress,
    ended: Callable[[], bool],
) -> Path:
    here = light_folder(folder, header.light)
    with _room_on(folder):
        store, journal = open_light(here, header)
    taken = whole_frames(store, journal, check=not (here / MANIFEST_FILE).exists())
    for index in frame_indices(header):
        if index.id in taken:
            progress.skip()
            continue
        if ended():
            problem = f"was interrupted; {progress.done} of {progress.total} frames are taken"
            raise Interrupted(folder, "capture", problem, "run it again: it resumes")
        begun = time.time()
        photograph = _take(rig, header, index)
        with _room_on(folder):
            store.write_at(*index.place, photograph.frame)
            times = {"begun": _utc(begun), "ended": _utc(time.time())}
            journal.append(index.id, photograph.frame, {**photograph.details, **times})
        if index.exposure == 0 and index.band_nm is not None:
            progress.note(_saturated(photograph, header.saturation))
        progress.step()
    store.flush()
    return write_manifest(here, header, journal.checksums())


def _take(rig: Rig, header: FramesHeader, index: FrameIndex) -> Taken:
    exposure_s = header.exposures_s[index.exposure]
    name = f"{header.light}/{index.id}"
    if index.band_nm is None:
        taken = rig.expose_dark(name, exposure_s)
        return Taken(taken.frame, {"exposure_s": exposure_s, **taken.details})
    gp, gr, ar, ap = header.states_deg[header.reference_state if index.reference else index.state]
    light = Light(header.light, header.angle_deg)
    setting = Setting(light, index.band_nm, (gp, gr, ar, ap), exposure_s, position(header, index))
    taken = rig.expose(name, setting)
    return Taken(taken.frame, {"state_deg": [gp, gr, ar, ap], "exposure_s": exposure_s, **taken.details})


def _saturated(photograph: Taken, saturation: float) -> str:
    share = float(np.mean(photograph.frame >= saturation))
    return f"{100 * share:.2g} % saturated at the shortest exposure"


def _utc(seconds: float) -> str:
    return datetime.fromtimestamp(seconds, UTC).isoformat(timespec="milliseconds")


@contextmanager
def _room_on(folder: Path) -> Iterator[None]:
    """Say it in words when the disk is full: what was being written does not count."""
    try:
        yield
    except OSError as error:
        if error.errno not in (errno.ENOSPC, errno.EDQUOT):
            raise
        raise InputError(folder, "disk", "is full", "make room and run again: it resumes") from None
