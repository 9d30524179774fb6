"""Nodes of the published tables."""

from __future__ import annotations

import numpy as np

from pbrdf.tabulation.axes import table_axes


def test_default_nodes_are_those_of_the_published_tables() -> None:
    axes = table_axes()
    assert axes.shape == (91, 91, 361)
    degrees = np.arange(91)
    np.testing.assert_allclose(np.rad2deg(axes.theta_h), (degrees / 90) ** 2 * 90, atol=1e-12)
    np.testing.assert_allclose(np.rad2deg(axes.theta_d), degrees, atol=1e-12)
    np.testing.assert_allclose(np.rad2deg(axes.phi_d), np.arange(-180, 181), atol=1e-12)


def test_fewer_nodes_are_a_subset() -> None:
    whole, half = table_axes(), table_axes(46, 46, 181)
    np.testing.assert_allclose(half.theta_h, whole.theta_h[::2], atol=1e-15)
    np.testing.assert_allclose(half.theta_d, whole.theta_d[::2], atol=1e-15)
    np.testing.assert_allclose(half.phi_d, whole.phi_d[::2], atol=1e-14)


def test_both_ends_are_exact() -> None:
    for axis, first, last in zip(
        vars(table_axes(7, 5, 9)).values(), (0.0, 0.0, -np.pi), (np.pi / 2, np.pi / 2, np.pi), strict=True
    ):
        assert (axis[0], axis[-1]) == (first, last)
        assert np.all(np.diff(axis) > 0)
