"""The page of the closed loop: what came back of the materials that were photographed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from pbrdf.formats.documents import write_text
from pbrdf.formats.receipt import digest
from pbrdf.report.html import render
from pbrdf.tabulation.closed_loop import EXPORTS, LEAST_COSINE, LEAST_THETA_D_DEG, ClosedLoop


def write_closed_loop_page(documents: Sequence[str | Path], page: str | Path) -> None:
    """Write the page of some materials; raises `InputError` if a document is damaged."""
    provenance = {f"{Path(path).stem} (SHA-256)": digest([path]) for path in documents}
    loops = [ClosedLoop.read(path) for path in documents]
    write_text(page, closed_loop_page(loops, provenance | {"pbrdf": version("pbrdf")}))


def closed_loop_page(loops: Sequence[ClosedLoop], provenance: Mapping[str, str]) -> str:
    """Page of some materials.

    Parameters
    ----------
    loops : sequence of ClosedLoop
    provenance : mapping of str to str
        Digests and versions, shown as they are.

    Returns
    -------
    str
        HTML; the same bytes for the same arguments.
    """
    return render(
        "closed_loop.html.j2",
        title="Closed loop",
        index=None,
        exports=EXPORTS,
        least_cosine=LEAST_COSINE,
        least_theta_d=LEAST_THETA_D_DEG,
        materials=[_material(loop) for loop in loops],
        provenance=provenance,
    )


def _material(loop: ClosedLoop) -> dict[str, Any]:
    """Rows of a material: its bands, and its elements over them."""
    measured = [bands["measured"] for bands in loop.bands.values()]
    sixteen = {
        name: np.median([getattr(each, f"element_{name}") for each in measured], axis=0).tolist()
        for name in ("median", "p90")
    }
    return {
        "name": loop.material,
        "truth": loop.truth,
        "directions": loop.directions,
        "bands": [{"nm": nm, **exports} for nm, exports in loop.bands.items()],
        "elements": sixteen,
    }
