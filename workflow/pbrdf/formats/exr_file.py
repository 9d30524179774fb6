"""OpenEXR files, whole or not at all."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import OpenEXR
from numpy.typing import NDArray


def write_exr(path: str | Path, header: Mapping[str, Any], channels: Mapping[str, NDArray[Any]]) -> None:
    """Write a scan-line image beside, then rename, so that `path` never holds half of one.

    Parameters
    ----------
    path : str or Path
    header : mapping
        Its attributes, `compression` among them.
    channels : mapping of str to ndarray, shape (rows, columns), float32, float16 or uint32
        C-contiguous, by name.
    """
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    beside = path.with_name(f".{path.name}.part")
    try:
        with OpenEXR.File({"type": OpenEXR.scanlineimage, **header}, dict(channels)) as image:
            image.write(str(beside))
        beside.replace(path)
    except BaseException:
        beside.unlink(missing_ok=True)
        raise
