"""What a virtual camera's pixels see of a scene told ray by ray."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import ndimage

Float = NDArray[np.float64]

BLUR_PX = 0.8
"""Standard deviation of the lens's blur where edges and highlights must not alias."""


def rays_through(rig: dict[str, Any], columns: ArrayLike, rows: ArrayLike) -> Float:
    """Points (..., 3) at unit depth that a virtual rig's camera sees at places of its image.

    Parameters
    ----------
    rig : dict
        The rig's file, checked against its schema.
    columns, rows : array_like, shapes that broadcast to (...)
        Px; the first pixel's centre is (0, 0).
    """
    camera = rig["camera"]
    cx, cy = camera["principal_px"]
    x = (np.asarray(columns, dtype=np.float64) - cx) / camera["focal_px"]
    y = (np.asarray(rows, dtype=np.float64) - cy) / camera["focal_px"]
    x, y = np.broadcast_arrays(x, y)
    return np.stack([x, y, np.ones_like(x)], -1)


def seen_by_pixels(rig: dict[str, Any], radiance: Callable[[Float], Float], samples: int) -> Float:
    """Mean radiance (rows, columns) over the area of each pixel, blurred by the lens.

    Parameters
    ----------
    rig : dict
        The rig's file, checked against its schema.
    radiance : callable
        Radiance (...) along rays (..., 3) from the camera, given as points at unit depth.
    samples : int
        Rays a pixel along each side.
    """
    rows, columns = np.arange(rig["camera"]["rows"])[:, None], np.arange(rig["camera"]["columns"])
    offsets = (np.arange(samples) + 0.5) / samples - 0.5
    total = np.zeros((rows.size, columns.size))
    for down in offsets:
        for right in offsets:
            total += radiance(rays_through(rig, columns + right, rows + down))
    blurred: Float = ndimage.gaussian_filter(total / samples**2, BLUR_PX, mode="nearest")
    return blurred


def unpolarised(radiance: Float) -> NDArray[np.float32]:
    """Mueller image (rows, columns, 16) of light that leaves the scene unpolarised.

    M00 alone is not zero: an ideal generator and analyser let a quarter of it through in every state.
    """
    image = np.zeros((*radiance.shape, 16), np.float32)
    image[..., 0] = radiance
    return image
