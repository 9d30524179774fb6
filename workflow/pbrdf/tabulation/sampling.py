"""From the Mueller images of a light to its slice of the table."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from pbrdf.optics.frames import change_frames
from pbrdf.tabulation.axes import Axes
from pbrdf.tabulation.corners import Corners
from pbrdf.tabulation.pixel_means import Cells, locate_cells, node_means
from pbrdf.tabulation.slices import Slice
from pbrdf.tabulation.surface import SurfacePoints, node_points
from pbrdf.tabulation.view import BandImage, Viewpoint

Float = NDArray[np.float64]
_Value = TypeVar("_Value", bound=np.generic)
_Window = tuple[tuple[int, int], tuple[int, ...]]

BETWEEN_FOUR = 4
"""Pixels behind an interpolated node."""


def make_slice(
    view: Viewpoint, images: Iterable[tuple[int, BandImage]], axes: Axes, grazing_deg: float
) -> Slice:
    """Slice of one light.

    Where many pixels share a node, all of them tell it (`node_means`); where a node is smaller than a
    few pixels, it is interpolated between the four around the point that shows it.

    Parameters
    ----------
    view : Viewpoint
    images : iterable of (int, BandImage)
        Band centre, nm, and image; one is in memory at a time if the iterable makes them so.
    axes : Axes
        Nodes of the table.
    grazing_deg : float
        Nodes whose light or camera stands lower than this from the normal are left out, degrees.

    Notes
    -----
    Turning the frames mixes elements whose noise is correlated: the images' variances say how large
    it is, their noise model how the elements hang together.
    """
    limit = float(np.cos(np.deg2rad(grazing_deg)))
    nodes = _Nodes.of(view, axes, limit)
    bands, parts = [], []
    located: dict[_Window, Cells] = {}
    for band_nm, image in images:
        window = image.first, image.mueller.shape[1:]
        if window not in located:
            # bands mostly share one window
            located = {window: locate_cells(view, axes, *window, limit)}
        bands.append(band_nm)
        parts.append(_band(nodes, located[window], image))
        # or it would stay while the next is read
        del image
    mueller, variance, count = (np.stack(arrays) for arrays in zip(*parts, strict=True))
    return Slice(
        view.angle_deg,
        tuple(bands),
        _both_ends(mueller, 2),
        _both_ends(variance, 2),
        _both_ends(count, 2),
        _both_ends(nodes.points.theta_d, 1),
    )


def _both_ends(values: NDArray[_Value], axis: int) -> NDArray[_Value]:
    """Repeat the values at φd = −π at +π, the same direction."""
    both: NDArray[_Value] = np.concatenate([values, np.take(values, [0], axis)], axis)
    return both


@dataclass(frozen=True)
class _Nodes:
    """Geometry of the nodes (H, P − 1) that a light may show, `seen`, and of those alone all else."""

    points: SurfacePoints
    seen: NDArray[np.bool_]
    row: Float
    column: Float
    gain: Float
    angle_in: Float
    angle_out: Float

    @classmethod
    def of(cls, view: Viewpoint, axes: Axes, limit: float) -> _Nodes:
        points = node_points(view.sphere, view.light_mm, axes.theta_h[:, None], axes.phi_d[None, :-1])
        seen = (points.cos_light > limit) & (points.cos_camera > limit)
        angle_in, angle_out = points.frame_angles(view.arm.generator_x(view.angle_deg), view.analyser_axis)
        column, row = view.camera.project(points.position_mm[seen])
        # what the light's distance and slant took away, m²
        gain = (points.light_distance_mm[seen] * 1e-3) ** 2 / points.cos_light[seen]
        return cls(points, seen, row, column, gain, angle_in[seen], angle_out[seen])


def _band(
    nodes: _Nodes, cells: Cells, image: BandImage
) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.uint16]]:
    """Matrices, variances (H, P − 1, 4, 4) and counts (H, P − 1) of one band."""
    means = node_means(cells, image.mueller, image.variance)
    values, spread = (
        means.mueller[nodes.seen].astype(np.float64),
        means.variance[nodes.seen].astype(np.float64),
    )
    behind = means.count[nodes.seen]
    alone = behind == 0
    between = _bilinear(image, nodes.row[alone], nodes.column[alone])
    gain = nodes.gain[alone, None]
    values[alone], spread[alone] = between[0] * gain, between[1] * gain**2
    behind[alone] = np.where(np.isfinite(between[0][:, 0]), BETWEEN_FOUR, 0)

    known = behind > 0
    angles = nodes.angle_in[known], nodes.angle_out[known]
    as_measured = nodes.gain[known, None]
    turned = image.noise.turned_variance(values[known] / as_measured, spread[known] / as_measured**2, *angles)
    shape = (*nodes.seen.shape, 4, 4)
    mueller, variance = np.full((2, *shape), np.nan, np.float32)
    count = np.zeros(nodes.seen.shape, np.uint16)
    where = np.zeros_like(nodes.seen)
    where[nodes.seen] = known
    mueller[where] = change_frames(values[known].reshape(-1, 4, 4), *angles) / image.scale
    variance[where] = (turned * (as_measured / image.scale) ** 2).reshape(-1, 4, 4)
    count[where] = behind[known]
    return mueller, variance, count


def _bilinear(image: BandImage, row: Float, column: Float) -> tuple[Float, Float]:
    """Matrices and variances (n, 16) between the four pixels around each place; NaN beyond the window."""
    corners, inside = Corners.around(column, row).within(image.first, image.mueller.shape[1:])
    values, spread = np.full((2, 16, row.size), np.nan)
    values[:, inside], spread[:, inside] = 0.0, 0.0
    for r, c, weight in zip(corners.row, corners.column, corners.weight, strict=True):
        values[:, inside] += weight * image.mueller[:, r, c]
        spread[:, inside] += weight**2 * image.variance[:, r, c]
    return values.T, spread.T
