"""Nodes of the table from all the pixels around each: cells, their sums, and a quadratic through them."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil

import numpy as np
from numpy.typing import NDArray

from pbrdf._kernels import cell_fit, cell_sums, pixel_cells
from pbrdf.tabulation.axes import Axes, table_axes
from pbrdf.tabulation.view import Viewpoint

FINEST = (90, 360)
"""Cells of θh and φd are no larger than those of the published tables: over a larger one a material may
vary by more than a quadratic tells."""


@dataclass(frozen=True)
class Cells:
    """Cells of the table's grid that the pixels of a window of the frame show.

    Attributes
    ----------
    grid, stride : tuple of int
        Numbers of cells of θh and φd, and every how manieth is a node's.
    cell : ndarray, shape (rows, columns), int32
        Of each pixel; `pixel_cells.NO_CELL` where none is shown.
    theta_h, phi_d : ndarray, shape (rows, columns), float32
        Place within the cell, in cells from its centre.
    gain : ndarray, shape (rows, columns), float32
        d² / cosθi, m².
    """

    grid: tuple[int, int]
    stride: tuple[int, int]
    cell: NDArray[np.int32]
    theta_h: NDArray[np.float32]
    phi_d: NDArray[np.float32]
    gain: NDArray[np.float32]


@dataclass(frozen=True)
class NodeMeans:
    """Values at nodes, in the frames of the modules, arrays (H, P − 1, …).

    Attributes
    ----------
    mueller, variance : ndarray, shape (H, P − 1, 16), float32
        Of the image times d² / cosθi; NaN where the cells do not tell the node.
    count : ndarray, shape (H, P − 1), uint16
        Pixels behind each value; 0 where there is none.
    """

    mueller: NDArray[np.float32]
    variance: NDArray[np.float32]
    count: NDArray[np.uint16]


def locate_cells(
    view: Viewpoint, axes: Axes, first: tuple[int, int], shape: tuple[int, ...], least_cosine: float
) -> Cells:
    """Cells that the pixels of a window show.

    Parameters
    ----------
    view : Viewpoint
    axes : Axes
        Of `table_axes`.
    first, shape : tuple of int
        Row and column of the window's corner, and its numbers of rows and columns.
    least_cosine : float
        Pixels whose light or camera stands lower than this over the surface show no cell.

    Raises
    ------
    ValueError
        If the axes are not those of `table_axes`.
    """
    theta_h, _, phi_d = axes.shape
    if not np.allclose(axes.theta_h, table_axes(*axes.shape).theta_h, atol=1e-12):
        raise ValueError("cells are laid out for the axes of `table_axes`")
    nodes = (theta_h - 1, phi_d - 1)
    stride = ceil(FINEST[0] / nodes[0]), ceil(FINEST[1] / nodes[1])
    grid = stride[0] * nodes[0] + 1, stride[1] * nodes[1]
    camera, sphere = view.camera, view.sphere
    cell = np.empty(shape, np.int32)
    places = [np.empty(shape, np.float32) for _ in range(3)]
    pixel_cells.locate(
        pixel_cells.Lens(camera.focal_px, camera.principal_px, camera.distortion),
        pixel_cells.LitSphere(sphere.centre_mm, sphere.radius_mm, view.light_mm),
        first,
        least_cosine,
        grid,
        cell,
        *places,
    )
    return Cells(grid, stride, cell, *places)


def node_means(cells: Cells, mueller: NDArray[np.float32], variance: NDArray[np.float32]) -> NodeMeans:
    """Values at the nodes from all pixels of the 3 × 3 cells around each.

    A quadratic in the places of the pixels is fitted to the cells' means by least squares, so that
    neither the curvature of the function nor the chance places of the pixels bias its value at the
    node, as they do a plain mean. Left out are nodes with an empty cell beside them, and those that
    an interpolation between four pixels tells with less noise.

    Parameters
    ----------
    cells : Cells
    mueller, variance : ndarray, shape (16, rows, columns), float32
        Of the window; NaN where a pixel is missing.
    """
    sums = np.empty((cells.grid[0] * cells.grid[1], cell_sums.SUMS_PER_CELL), np.float32)
    cell_sums.sum(mueller, variance, cells.cell, cells.theta_h, cells.phi_d, cells.gain, sums)
    nodes = (cells.grid[0] - 1) // cells.stride[0] + 1, cells.grid[1] // cells.stride[1]
    values, spread = np.empty((2, *nodes, 16), np.float32)
    count = np.empty(nodes, np.uint16)
    cell_fit.fit(sums, cells.grid, cells.stride, values, spread, count)
    return NodeMeans(values, spread, count)
