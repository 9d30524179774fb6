"""Photographs of the virtual rig without its instruments, which take the longest at the paper's size."""

from __future__ import annotations

from pathlib import Path

from pbrdf.capture.run import capture
from pbrdf.instruments.interface import FrameFormat, Setting, Taken
from pbrdf.instruments.virtual_rig import VirtualRig
from pbrdf.instruments.virtual_sphere import VirtualSphere
from pbrdf.settings.plan import CapturePlan
from pbrdf.settings.rig import RigSettings


class StraightRig:
    """A virtual rig that is asked for frames, not driven (`pbrdf.instruments.interface.Rig`)."""

    def __init__(self, rig: VirtualRig) -> None:
        self._rig = rig

    @property
    def identity(self) -> str:
        """See `VirtualRig.identity`."""
        return self._rig.identity

    @property
    def frame_format(self) -> FrameFormat:
        """See `VirtualRig.frame_format`."""
        return self._rig.frame_format

    def expose(self, frame_id: str, setting: Setting) -> Taken:
        """See `VirtualRig.expose`."""
        return Taken(self._rig.expose(frame_id, setting), {})

    def expose_dark(self, frame_id: str, exposure_s: float) -> Taken:
        """See `VirtualRig.expose_dark`."""
        return Taken(self._rig.expose_dark(frame_id, exposure_s), {})


def photograph(
    plan: CapturePlan,
    rig: RigSettings,
    source: str | Path,
    material: str,
    radius_mm: float,
    folder: str | Path,
) -> None:
    """Carry out a plan; parameters as of `pbrdf.capture.material.capture_material`."""
    sphere = VirtualSphere(rig.with_sphere(material, source), material, radius_mm, source)
    capture(plan, material, StraightRig(VirtualRig(rig.with_sphere(material, source), sphere)), folder)
