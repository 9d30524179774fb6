"""The rig of a rig's file, ready to take photographs."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from pbrdf.instruments.emulators.rig import emulated_rig
from pbrdf.instruments.emulators.scene import Renderer
from pbrdf.instruments.instrument_rig import InstrumentRig
from pbrdf.instruments.manual import Operator
from pbrdf.instruments.open_rig import open_real


def covered_by_hand(rig: Mapping[str, Any]) -> bool:
    """Whether an operator covers the lamp for dark frames: nobody wants to be asked at every light."""
    return bool(rig.get("dark") == "operator")


@contextmanager
def open_rig(
    rig: Mapping[str, Any], source: str | Path, renderer: Callable[[], Renderer], task: str
) -> Iterator[InstrumentRig]:
    """Open a rig that holds what is to be photographed, and let go of it in the end.

    Parameters
    ----------
    rig : mapping
        The rig's file, checked against its schema.
    source : str or Path
        That file, for messages.
    renderer : callable
        Makes what a virtual rig's camera sees.
    task : str
        What the operator of a real rig has to do before.

    Raises
    ------
    InputError
        If the file does not say how the rig is driven.
    InstrumentError
        If an instrument cannot be opened, or nobody can be asked.
    """
    if rig["kind"] == "virtual":
        with emulated_rig(rig, renderer()) as emulated:
            yield emulated
        return
    with open_real(rig, source) as real:
        Operator().ask("rig", task)
        yield real
