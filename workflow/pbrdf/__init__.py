"""From polarised photographs of a sphere to a polarimetric BRDF.

``pbrdf.open_table(path)`` opens a table in any format; ``table.evaluate(to_light, to_camera, wavelength_nm)``
gives Mueller matrices; ``pbrdf.fit(table, "baek2018")`` fits a model; ``pbrdf.write_capture(...)`` brings
photographs from anywhere into the workflow; ``pbrdf.mueller_of_frames(...)`` is a quick look at some of them.
"""

from __future__ import annotations

import os
from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pbrdf.capture.arrays import write_capture
    from pbrdf.fitting import fit
    from pbrdf.models.table import Table, open_table
    from pbrdf.reconstruction.frames import mueller_of_frames

# Threads of the kernels that spin while they wait take the processor from those of emulated instruments: a
# frame of the virtual rig cost 6.1 ms of it, now 3.5. Without any spinning, a thread woken for each call of a
# fit is put on the core of the one that wakes it, and a second core is of no use.
os.environ.setdefault("OMP_WAIT_POLICY", "passive")
os.environ.setdefault("GOMP_SPINCOUNT", "3000")

__all__ = ["Table", "fit", "mueller_of_frames", "open_table", "write_capture"]

_DOORS = {
    "Table": "pbrdf.models.table",
    "fit": "pbrdf.fitting",
    "mueller_of_frames": "pbrdf.reconstruction.frames",
    "open_table": "pbrdf.models.table",
    "write_capture": "pbrdf.capture.arrays",
}


def __getattr__(name: str) -> Any:
    """Import what a door leads to when it is opened: a stage then pays for its own imports alone."""
    if name not in _DOORS:
        raise AttributeError(f"module 'pbrdf' has no attribute {name!r}")
    return getattr(import_module(_DOORS[name]), name)
