"""The supplement's tabulation: each bin from the one light whose θt is nearest (SUPP §3).

The reference to compare with. A light gives the bins for which it is the nearest: its *share*.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from pbrdf.optics.rusinkiewicz import cosines
from pbrdf.tabulation.axes import Axes
from pbrdf.tabulation.corners import Corners
from pbrdf.tabulation.inverse_map import Slip, circle_crossing, nearest_light
from pbrdf.tabulation.pixels import between_pixels
from pbrdf.tabulation.shares import Share
from pbrdf.tabulation.surface import normal_points
from pbrdf.tabulation.view import BandImage, Viewpoint

Float = NDArray[np.float64]

BETWEEN_FOUR = 4
"""Pixels behind a bin."""


def make_share(
    view: Viewpoint,
    angles_deg: Sequence[float],
    images: Iterable[tuple[int, BandImage]],
    axes: Axes,
    grazing_deg: float,
    widest_gap: float = np.inf,
    slips: Collection[Slip] = (),
) -> Share:
    """Share of one light in the table.

    Parameters
    ----------
    view : Viewpoint
        Of this light.
    angles_deg : sequence of float
        Angles of the arm of all lights, this one's among them.
    images : iterable of (int, BandImage)
        Band centre, nm, and image; one is in memory at a time if the iterable makes them so.
    axes : Axes
        Bins of the table.
    grazing_deg : float
        Bins whose light or camera stands lower than this from the normal are left out, degrees.
    widest_gap : float
        Bins whose θt is farther than this from the nearest light's are left out, radians: half the step
        of θt that is twice as wide a step of θd.
    slips : collection of Slip
        Those of the supplement to reproduce.
    """
    nodes = _own_bins(view, angles_deg, axes, np.cos(np.deg2rad(grazing_deg)), widest_gap, slips)
    grid = np.unravel_index(nodes, axes.shape)
    bins = axes.theta_h[grid[0]], axes.theta_d[grid[1]], axes.phi_d[grid[2]]
    points = normal_points(view.sphere, view.light_mm, circle_crossing(view.sphere, view.light_mm, bins))
    columns, rows = view.camera.project(points.position_mm)
    met = np.isfinite(columns) & np.isfinite(rows)
    corners = Corners.around(columns[met], rows[met])
    bands, parts = [], []
    for band_nm, image in images:
        bands.append(band_nm)
        parts.append(between_pixels(view, image, corners))
        # or it would stay while the next is read
        del image
    mueller, variance = (np.stack(arrays).astype(np.float32) for arrays in zip(*parts, strict=True))
    count = np.where(np.isfinite(mueller[..., 0, 0]), BETWEEN_FOUR, 0).astype(np.uint16)
    return Share(view.angle_deg, tuple(bands), axes.shape, nodes[met], mueller, variance, count)


def _own_bins(
    view: Viewpoint,
    angles_deg: Sequence[float],
    axes: Axes,
    least_cosine: float,
    widest_gap: float,
    slips: Collection[Slip],
) -> NDArray[np.int64]:
    """Flat indices of the bins for which this light is the nearest, ascending."""
    angles = np.sort(np.asarray(angles_deg, dtype=np.float64))
    mine = int(np.argmin(np.abs(angles - view.angle_deg)))
    lights = np.stack([view.arm.light_position(angle) for angle in angles])
    theta_h, phi_d = axes.theta_h[:, None], axes.phi_d[None, :]
    found = []
    for d, theta_d in enumerate(axes.theta_d):
        cos_light, cos_camera = cosines(theta_h, theta_d, phi_d)
        h, p = np.nonzero((cos_light > least_cosine) & (cos_camera > least_cosine))
        bins = axes.theta_h[h], np.full(len(h), theta_d), axes.phi_d[p]
        index, off = nearest_light(view.sphere, lights, bins, slips)
        own = (index == mine) & (off <= widest_gap)
        found.append(np.ravel_multi_index((h[own], np.full(own.sum(), d), p[own]), axes.shape))
    return np.sort(np.concatenate(found)).astype(np.int64)
