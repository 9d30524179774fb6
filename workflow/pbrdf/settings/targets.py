"""What is to be photographed of the targets of a calibration session."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

from pbrdf.errors import InputError
from pbrdf.optics.elements import IDEAL
from pbrdf.settings.plan import CapturePlan, Light, bright_state, light_id

AMBIENT = Light("000.00", 0.0)
"""Stands for the arm of what the lamp does not light: its angle means nothing."""


def session_plans(
    plan: CapturePlan, settings: Mapping[str, Any], source: str | Path
) -> dict[str, CapturePlan]:
    """Plan of every target of a session, by the target's name.

    Parameters
    ----------
    plan : CapturePlan
        The materials' plan.
    settings : mapping
        The config, checked against its schema.
    source : str or Path
        Its file, for messages.

    Returns
    -------
    dict
        The elements of `pbrdf.optics.elements.IDEAL` in the beam; ``chrome``, a mirror ball under every
        light; ``chrome_ambient``, the same ball; ``board_01`` and on, chessboards; ``flat``, an evenly
        bright field in one state many times; ``spectralon``, a white tile.

    Raises
    ------
    InputError
        If exposures do not ascend.
    """
    session = settings["session"]
    plans = {name: target_plan(plan, settings["validation"], source, "validation") for name in IDEAL}
    plans["chrome"] = replace(_single(plan, session, "chrome", source), lights=plan.lights)
    plans["chrome_ambient"] = ambient_plan(plan, session, source)
    plans |= {
        name: _single(plan, session, "board", source) for name in board_names(session["board"]["views"])
    }
    flat = session["flat"]
    plans["flat"] = replace(
        _single(plan, session, "flat", source),
        bands_nm=plan.bands_nm,
        states_deg=(plan.states_deg[bright_state(plan.states_deg)],) * flat["repeats"],
        darks=flat["darks"],
    )
    plans["spectralon"] = replace(
        plan,
        lights=tuple(_light(angle) for angle in session["spectralon"]["lights_deg"]),
        exposures_s=_exposures_s(session["spectralon"], source, "session.spectralon"),
        metering=None,
    )
    return plans


def board_names(views: int) -> list[str]:
    """Targets that show the chessboard."""
    return [f"board_{view:02d}" for view in range(1, views + 1)]


def board_view(target: str) -> int:
    """Number, from 1 on, of the view that a target of `board_names` is."""
    return int(target.removeprefix("board_"))


def ambient_plan(plan: CapturePlan, session: Mapping[str, Any], source: str | Path) -> CapturePlan:
    """Plan of a ball under ambient light; raises `InputError` if the exposures do not ascend."""
    return _single(plan, session, "ambient", source)


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
    return replace(
        plan,
        lights=(_light(section["light_deg"]),),
        exposures_s=_exposures_s(section, source, field),
        metering=None,
    )


def _light(angle_deg: float) -> Light:
    return Light(light_id(angle_deg), round(float(angle_deg), 2))


def _single(plan: CapturePlan, session: Mapping[str, Any], section: str, source: str | Path) -> CapturePlan:
    """Plan of one frame for each exposure of a section, and a dark: middle band, a bright state, no lamp."""
    return CapturePlan(
        lights=(AMBIENT,),
        bands_nm=(plan.bands_nm[len(plan.bands_nm) // 2],),
        states_deg=(plan.states_deg[bright_state(plan.states_deg)],),
        exposures_s=_exposures_s(session[section], source, f"session.{section}"),
        darks=1,
    )


def _exposures_s(section: Mapping[str, Any], source: str | Path, field: str) -> tuple[float, ...]:
    exposures = section["exposures_ms"]
    if any(b <= a for a, b in pairwise(exposures)):
        raise InputError(
            source, f"{field}.exposures_ms", "does not ascend strictly", "sort it and drop what is doubled"
        )
    return tuple(ms / 1000.0 for ms in exposures)
