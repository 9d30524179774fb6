"""A rig's file, checked."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any

from pbrdf.settings.checked import read_checked


class RigSettings(dict[str, Any]):
    """Content of a rig's file; shown by its digest, since workflows print what changed of their parameters."""

    def __repr__(self) -> str:
        """Short form: equal content gives equal text."""
        text = json.dumps(self, sort_keys=True)
        return f"RigSettings({self['kind']}, {hashlib.sha256(text.encode()).hexdigest()[:16]})"


def read_rig(path: str | Path) -> RigSettings:
    """Read a rig's file; raises `InputError` if it is not as its schema says."""
    return RigSettings(read_checked(path, "rig"))
