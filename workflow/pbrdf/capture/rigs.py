"""Which rigs can take photographs."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pbrdf.errors import InputError


def require_drivers(rig: Mapping[str, Any], source: str | Path) -> None:
    """Refuse a rig, given with the name of its file, that nothing drives; raises `InputError`."""
    if rig["kind"] != "virtual":
        raise InputError(
            source,
            "kind",
            "drivers for a real rig do not exist yet",
            "write the frames with pbrdf.write_capture",
        )
