"""The nodes of a table that a fit looks at: every n-th of them, or the means of blocks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from pbrdf.errors import InputError
from pbrdf.fitting.blocks import block_means
from pbrdf.fitting.solid_angle import cell_weights
from pbrdf.formats.table_data import Origin, TableData
from pbrdf.optics.rusinkiewicz import cosines, directions

Float = NDArray[np.float64]

_HORIZON = 1e-9
"""Least cosine of a node that counts as above the horizon: rounding puts θi = 90° at 6e-17."""
_HELD_OUT = 10
"""Of so many slabs of θd one is held out."""


@dataclass(frozen=True)
class Nodes:
    """Nodes of a table with a measured value in at least one band.

    Attributes
    ----------
    indices : ndarray, shape (n, 3), intp
        Positions on the axes θh, θd, φd of the table; of a block, those of its first node.
    to_light, to_camera : ndarray, shape (n, 3), float64
        Unit vectors with z the normal.
    mueller : ndarray, shape (B, n, 4, 4), float32
        1/sr, table frames; zero where the weight is zero.
    weight : ndarray, shape (B, n), float32
        0 where the band has no measured value. Elsewhere 1, or the node's share of the pairs of
        directions, in units of the mean share.
    variance : ndarray or None, shape (B, n, 4, 4), float32
        1/sr², above zero wherever the weight is; None where the table does not tell.
    """

    indices: NDArray[np.intp]
    to_light: Float
    to_camera: Float
    mueller: NDArray[np.float32]
    weight: NDArray[np.float32]
    variance: NDArray[np.float32] | None = None

    @cached_property
    def norms(self) -> Float:
        """Frobenius norm of each matrix, shape (B, n), 1/sr; 0 where the weight is zero."""
        norms: Float = np.linalg.norm(self.mueller.astype(np.float64), axis=(-2, -1))
        return norms

    @cached_property
    def scale(self) -> Float:
        """Typical norm of a matrix in each band, shape (B,), 1/sr: the median, or the mean if that is 0."""
        scale = np.empty(len(self.norms))
        for band, (norms, weight) in enumerate(zip(self.norms, self.weight, strict=True)):
            known = norms[weight > 0]
            scale[band] = np.median(known) or np.mean(known)
        return scale

    def subset(self, chosen: NDArray[np.intp] | NDArray[np.bool_]) -> Nodes:
        """Only the nodes at the positions `chosen`, or where it is true."""
        return Nodes(
            self.indices[chosen],
            self.to_light[chosen],
            self.to_camera[chosen],
            self.mueller[:, chosen],
            self.weight[:, chosen],
            None if self.variance is None else self.variance[:, chosen],
        )


def select_nodes(
    data: TableData,
    downsample: int,
    *,
    blocks: bool = False,
    solid_angle: bool = False,
    with_variance: bool = False,
) -> Nodes:
    """Take every `downsample`-th node of each direction axis that holds a measured value.

    Left out are nodes at or below the horizon, those with θd = 0 (where the frames are not
    defined), those with a value that is not finite or with zeros alone, and, if the table tells the
    origin of its values, those that are not measured.

    Parameters
    ----------
    data : TableData
        The table.
    downsample : int
        Nodes along each side of a block.
    blocks : bool
        Average the measured nodes of each block, rather than take its first (`block_means`).
    solid_angle : bool
        Weigh each node with the share of all pairs of directions that it stands for (`cell_weights`).
    with_variance : bool
        Demand variances; nodes where they are not above zero are left out too.

    Raises
    ------
    InputError
        If `downsample` is below 1, a band has no such node or none with a positive M00, or variances
        are demanded of a table without any.
    """
    if downsample < 1:
        raise InputError("fit", "downsample", f"is {downsample}", "give a whole number of at least 1")
    if with_variance and data.variance is None:
        raise InputError(data.source, "variance", "is not in the table", "choose the cost `norms`")
    axes = (data.theta_h, data.theta_d, data.phi_d)
    rows = tuple(np.arange(0, len(axis), 1 if blocks else downsample) for axis in axes)
    grid = np.ix_(np.arange(len(data.wavelengths_nm)), *rows)
    angles = list(np.meshgrid(*(axis[row] for axis, row in zip(axes, rows, strict=True)), indexing="ij"))
    mueller = data.mueller[grid]
    variance = None if data.variance is None else data.variance[grid]
    measured = _measured(mueller, None if data.origin is None else data.origin[grid], angles)
    if with_variance and variance is not None:
        measured &= (np.isfinite(variance) & (variance > 0)).all(axis=(-2, -1))
    share = cell_weights(axes, rows) if solid_angle else np.ones(mueller.shape[1:4])

    if blocks:
        means = block_means(angles, mueller, variance, measured, share, downsample)
        positions, angles, mueller, variance = means.first, means.angles, means.mueller, means.variance
        measured = means.measured & _above_horizon(angles)
        share = means.share if solid_angle else np.ones(len(positions))
    else:
        used = measured.any(axis=0)
        found = np.argwhere(used)
        positions = np.stack([row[p] for row, p in zip(rows, found.T, strict=True)], axis=-1)
        angles, share = [a[used] for a in angles], share[used]
        mueller, measured = mueller[:, used], measured[:, used]
        variance = None if variance is None else variance[:, used]
    to_light, to_camera = directions(*angles)
    nodes = Nodes(
        positions,
        to_light,
        to_camera,
        np.where(measured[..., None, None], mueller, np.float32(0.0)).astype(np.float32, copy=False),
        _weights(measured, share),
        variance,
    )
    _check_bands(data, nodes, downsample)
    return nodes


def hold_out(nodes: Nodes) -> tuple[Nodes, Nodes] | None:
    """Split off every tenth slab of equal θd: (nodes to fit, nodes held out).

    Neighbours of fitted nodes share photographs and pixels with them, a slab as a whole does not.
    The first that is held out is the sixth, so that both ends of the axis stay. None where a table
    has fewer slabs than that, or where a band would be left with nothing.
    """
    slabs = np.unique(nodes.indices[:, 1])
    held = np.isin(nodes.indices[:, 1], slabs[_HELD_OUT // 2 :: _HELD_OUT])
    parts = nodes.subset(~held), nodes.subset(held)
    if all(np.any(weight > 0) for part in parts for weight in part.weight):
        return parts
    return None


def _measured(
    mueller: NDArray[np.float32], origin: NDArray[np.uint8] | None, angles: list[Float]
) -> NDArray[np.bool_]:
    # a matrix of zeros alone is how a file without NaN says that it knows nothing
    measured: NDArray[np.bool_] = np.isfinite(mueller).all(axis=(-2, -1)) & (mueller != 0).any(axis=(-2, -1))
    if origin is not None:
        measured &= origin == Origin.MEASURED
    measured &= _above_horizon(angles)
    return measured


def _above_horizon(angles: Sequence[Float]) -> NDArray[np.bool_]:
    cos_i, cos_o = cosines(*angles)
    above: NDArray[np.bool_] = (np.minimum(cos_i, cos_o) > _HORIZON) & (angles[1] > 0)
    return above


def _weights(measured: NDArray[np.bool_], share: Float) -> NDArray[np.float32]:
    known = measured.any(axis=0)
    mean = share[known].mean() if known.any() else 1.0
    return (measured * (share / mean)).astype(np.float32)


def _check_bands(data: TableData, nodes: Nodes, downsample: int) -> None:
    for wavelength, mueller, weight in zip(data.wavelengths_nm, nodes.mueller, nodes.weight, strict=True):
        band = f"mueller at {wavelength:g} nm"
        if not np.any(weight):
            problem = f"holds nothing but zeros or NaN among its measured nodes (every {downsample}-th)"
            raise InputError(data.source, band, problem, "lower `downsample`, or leave the band out")
        if not np.any(mueller[weight > 0, 0, 0] > 0):
            raise InputError(
                data.source, band, "has no positive M00", "check the table, or leave the band out"
            )
