"""Carry out a plan: take what is missing, keep what is there."""

from __future__ import annotations

import errno
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from pbrdf.capture.frames import MANIFEST_FILE, FrameIndex, frame_parts, position, write_manifest
from pbrdf.capture.interruption import Interrupted, interruptible, sole_owner
from pbrdf.capture.journal import Journal
from pbrdf.capture.light_folder import begun_light, light_folder, open_light, whole_frames
from pbrdf.capture.metering import brightest_part, metered_ladder
from pbrdf.capture.progress import Progress
from pbrdf.errors import InputError
from pbrdf.formats.capture_store import FramesHeader, FrameStore
from pbrdf.instruments.interface import Rig, Setting, Taken
from pbrdf.settings.plan import CapturePlan, Light


def capture(
    plan: CapturePlan, material: str, rig: Rig, folder: str | Path, *, darks_at_ends: bool = False
) -> list[Path]:
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
    darks_at_ends : bool
        Whether the dark frames of all lights are taken at start and end, half of them each, since somebody
        has to cover the lamp by hand. No light is whole before the end then.

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
        run = _Run(plan, material, rig, Path(folder), darks_at_ends, progress, ended)
        return run.lamp_covered_twice() if darks_at_ends else run.light_by_light()


@dataclass(frozen=True)
class _Begun:
    """A light whose folder is open, and names of the frames that it had then."""

    header: FramesHeader
    folder: Path
    store: FrameStore
    journal: Journal
    taken: set[str]


@dataclass(frozen=True)
class _Run:
    plan: CapturePlan
    material: str
    rig: Rig
    folder: Path
    darks_at_ends: bool
    progress: Progress
    ended: Callable[[], bool]

    def light_by_light(self) -> list[Path]:
        manifests = []
        for light in self.plan.lights:
            begun = self.begin(light)
            for part in frame_parts(begun.header):
                self.take(begun, part)
            manifests.append(_finish(begun))
        return manifests

    def lamp_covered_twice(self) -> list[Path]:
        lights = [self.begin(light) for light in self.plan.lights]
        parts = [frame_parts(begun.header) for begun in lights]
        for turn in range(len(parts[0])):
            for begun, of_light in zip(lights, parts, strict=True):
                self.take(begun, of_light[turn])
        return [_finish(begun) for begun in lights]

    def begin(self, light: Light) -> _Begun:
        """Open a light's folder; before the first frame its exposures stand in the header there."""
        here = light_folder(self.folder, light.id)
        header = self._header(light, begun_light(here))
        with _room_on(self.folder):
            store, journal = open_light(here, header)
        taken = whole_frames(store, journal, check=not (here / MANIFEST_FILE).exists())
        return _Begun(header, here, store, journal, taken)

    def take(self, begun: _Begun, indices: Sequence[FrameIndex]) -> None:
        """Take those of a light's frames that it lacks."""
        for index in indices:
            if index.id in begun.taken:
                self.progress.skip()
                continue
            self._refuse_to_go_on()
            started = time.time()
            photograph = _take(self.rig, begun.header, index)
            with _room_on(self.folder):
                begun.store.write_at(*index.place, photograph.frame)
                times = {"begun": _utc(started), "ended": _utc(time.time())}
                begun.journal.append(index.id, photograph.frame, {**photograph.details, **times})
            if index.exposure == 0 and index.band_nm is not None:
                self.progress.note(_saturated(photograph, begun.header.saturation))
            self.progress.step()

    def _header(self, light: Light, begun: FramesHeader | None) -> FramesHeader:
        form = self.rig.frame_format
        metered, exposures_s = self._exposures(light, begun)
        return FramesHeader(
            material=self.material,
            light=light.id,
            source=self.rig.identity,
            angle_deg=light.angle_deg,
            bands_nm=self.plan.bands_nm,
            states_deg=self.plan.states_deg,
            exposures_s=exposures_s,
            darks=self.plan.darks,
            rows=form.rows,
            columns=form.columns,
            dtype=form.dtype,
            adc_bits=form.adc_bits,
            shift=form.shift,
            saturation=form.saturation,
            references=self.plan.references,
            reference_state=self.plan.reference_state,
            metered_dn_per_s=metered,
            darks_at_ends=self.darks_at_ends,
        )

    def _exposures(self, light: Light, begun: FramesHeader | None) -> tuple[float | None, tuple[float, ...]]:
        """What was metered, and the exposures of a light: of one that is begun as its header says."""
        plan, metering = self.plan, self.plan.metering
        if metering is None:
            return None, plan.exposures_s
        saturation = self.rig.frame_format.saturation
        if begun is not None:
            if begun.metered_dn_per_s is None:
                raise InputError(
                    light_folder(self.folder, light.id),
                    "exposures_s",
                    "the frames there were taken with fixed exposures, now they are to be metered",
                    "plan the fixed ones, or move the folder away that it lies in",
                )
            return begun.metered_dn_per_s, metered_ladder(plan, metering, begun.metered_dn_per_s, saturation)
        dn_per_s = brightest_part(plan, metering, light, self.rig, self._refuse_to_go_on)
        exposures_s = metered_ladder(plan, metering, dn_per_s, saturation)
        told = ", ".join(f"{1000 * exposure_s:g}" for exposure_s in exposures_s)
        print(f"light {light.id} of {self.material} is metered: {told} ms", file=sys.stderr, flush=True)
        return dn_per_s, exposures_s

    def _refuse_to_go_on(self) -> None:
        if self.ended():
            problem = f"was interrupted; {self.progress.done} of {self.progress.total} frames are taken"
            raise Interrupted(self.folder, "capture", problem, "run it again: it resumes")


def _finish(begun: _Begun) -> Path:
    begun.store.flush()
    return write_manifest(begun.folder, begun.header, begun.journal.checksums())


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
