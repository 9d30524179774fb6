"""What is to be photographed of the targets of a calibration session."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

from pbrdf.errors import InputError
from pbrdf.settings.plan import CapturePlan, Light, light_id


def target_plan(plan: CapturePlan, section: Mapping[str, Any], source: str | Path, field: str) -> CapturePlan:
    """Plan of a target that is lit from one side: all but light and exposures is that of the materials.

    Parameters
    ----------
    plan : CapturePlan
        The materials' plan.
    section : mapping
        Section of the config with the `light_deg` and the `exposures_ms` of the target, checked
        against its schema.
    source : str or Path
        The config's file, for messages.
    field : str
        Name of the section, for messages.

    Raises
    ------
    InputError
        If the exposures do not ascend.
    """
    exposures = section["exposures_ms"]
    if any(b <= a for a, b in pairwise(exposures)):
        raise InputError(
            source, f"{field}.exposures_ms", "does not ascend strictly", "sort it and drop what is doubled"
        )
    angle = float(section["light_deg"])
    return replace(
        plan,
        lights=(Light(light_id(angle), round(angle, 2)),),
        exposures_s=tuple(ms / 1000.0 for ms in exposures),
    )
