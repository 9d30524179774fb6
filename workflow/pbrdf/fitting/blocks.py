"""Means of a table's nodes over blocks of neighbours, each node counted by its variance."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]
Bool = NDArray[np.bool_]


@dataclass(frozen=True)
class BlockMeans:
    """Means over the blocks that hold anything; n of them.

    Attributes
    ----------
    first : ndarray, shape (n, 3), intp
        Positions of each block's first node on the axes θh, θd, φd.
    angles : list of three ndarrays, shape (n,), float64
        Mean θh, θd, φd, radians, of the nodes that were averaged.
    mueller : ndarray, shape (B, n, 4, 4), float32
        Mean matrices, 1/sr.
    variance : ndarray or None, shape (B, n, 4, 4), float32
        Variances of the means, 1/sr², with the nodes taken as independent.
    measured : ndarray, shape (B, n), bool
    share : ndarray, shape (n,), float64
        Sum of the shares of the nodes that were averaged.
    """

    first: NDArray[np.intp]
    angles: list[Float]
    mueller: NDArray[np.float32]
    variance: NDArray[np.float32] | None
    measured: Bool
    share: Float


def block_means(
    angles: Sequence[Float],
    mueller: NDArray[np.float32],
    variance: NDArray[np.float32] | None,
    measured: Bool,
    share: Float,
    side: int,
) -> BlockMeans:
    """Average the measured nodes of each block of `side`³ nodes.

    A node counts by the inverse of its mean variance over elements and bands, or every node
    the same where variances are not known. Its matrices and its angles count alike, and alike in
    all bands: a mean stands where its matrices were measured. So a node is averaged only
    if it is measured in all the bands that the block has at all. Where the surface is curved over a
    block, above all at grazing angles, the mean lies off the surface all the same.

    Parameters
    ----------
    angles : three ndarrays, shape (H, D, P), float64
        Radians.
    mueller, variance : ndarray, shape (B, H, D, P, 4, 4), float32
        1/sr and 1/sr².
    measured : ndarray, shape (B, H, D, P), bool
        Which values count.
    share : ndarray, shape (H, D, P), float64
        Summed, not averaged.
    side : int
        Nodes along each side of a block; the last of an axis may be shorter.
    """
    block, first = _blocks(measured.shape[1:], side)
    bands = len(measured)
    count = len(first)
    has_band: Bool = np.stack([np.bincount(block, one.ravel(), count) for one in measured]) > 0
    complete: Bool = np.all(measured.reshape(bands, -1) | ~has_band[:, block], axis=0)
    whole = complete & np.any(has_band[:, block], axis=0)
    weight = np.where(whole, _node_weights(variance, measured), 0.0)
    total = np.bincount(block, weight, count)
    kept = total > 0

    def mean(values: NDArray[np.floating[Any]], weights: Float) -> Float:
        # values that do not count may be NaN
        summed = np.bincount(block, np.where(weights > 0, weights * values.ravel(), 0.0), count)
        return np.asarray(summed[kept] / total[kept])

    def matrices(values: NDArray[np.float32], weights: Float) -> NDArray[np.float32]:
        means = np.empty((bands, int(kept.sum()), 4, 4), np.float32)
        for band, row, column in np.ndindex(bands, 4, 4):
            means[band, :, row, column] = mean(values[band, ..., row, column], weights)
        return means

    averaged_variance = None
    if variance is not None:
        averaged_variance = matrices(variance, weight**2)
        averaged_variance /= total[kept, None, None].astype(np.float32)
    return BlockMeans(
        first[kept],
        [mean(angle, weight) for angle in angles],
        matrices(mueller, weight),
        averaged_variance,
        has_band[:, kept],
        np.bincount(block, np.where(whole, share.ravel(), 0.0), count)[kept].astype(np.float64),
    )


def _blocks(shape: Sequence[int], side: int) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Block of each node of a grid, flat, and the first node of each block, shape (blocks, 3)."""
    sizes = [-(-length // side) for length in shape]
    positions = [np.arange(length) // side for length in shape]
    block = np.ravel_multi_index(np.meshgrid(*positions, indexing="ij"), sizes).ravel()
    first = np.stack(np.unravel_index(np.arange(np.prod(sizes)), sizes), axis=-1) * side
    return block, first


def _node_weights(variance: NDArray[np.float32] | None, measured: Bool) -> Float:
    """Inverse of the mean variance over elements and measured bands, flat; 1 without variances."""
    if variance is None:
        return np.ones(measured[0].size)
    known = measured.reshape(len(measured), -1)
    by_band = variance.reshape(*known.shape, 16).mean(axis=-1, dtype=np.float64)
    count = known.sum(axis=0)
    mean = np.where(known, by_band, 0.0).sum(axis=0) / np.maximum(count, 1)
    usable = np.isfinite(mean) & (mean > 0)
    weights: Float = np.divide(1.0, mean, out=np.zeros_like(mean), where=usable)
    return weights
