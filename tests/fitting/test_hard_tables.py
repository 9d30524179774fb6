"""Tables that cannot be fitted are refused; what a poor table cannot tell is marked."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from made_tables import TRUTH, largest_error, made_table

import pbrdf
from pbrdf.errors import InputError
from pbrdf.formats.table_data import TableData


def changed(table: TableData, band: int | slice = slice(None), **changes: float) -> TableData:
    """A copy with `M00`, or `every` element, of a band set to a value where it is known."""
    mueller = table.mueller.copy()
    known = ~np.isnan(mueller[band])
    if "M00" in changes:
        known[..., :, 1:] = known[..., 1:, :] = False
    (value,) = changes.values()
    mueller[band] = np.where(known, np.float32(value), mueller[band])
    return dataclasses.replace(table, mueller=mueller)


def one_slab(table: TableData, index: int) -> TableData:
    """What a single light far away shows: one θd."""
    mueller = np.full_like(table.mueller, np.nan)
    mueller[:, :, index] = table.mueller[:, :, index]
    return dataclasses.replace(table, mueller=mueller)


def test_one_band_is_enough() -> None:
    result = pbrdf.fit(made_table(TRUTH[1:2], noise=0.05), downsample=1)
    assert largest_error(result, TRUTH[1:2]) < 0.01
    assert result.undetermined == ()


@pytest.mark.parametrize("band", [0, 2])
@pytest.mark.parametrize(
    ("change", "problem"),
    [
        ({"every": np.nan}, "holds nothing but zeros or NaN"),
        ({"every": 0.0}, "holds nothing but zeros or NaN"),
        ({"M00": 0.0}, "has no positive M00"),
        ({"M00": -0.1}, "has no positive M00"),
    ],
    ids=["unseen", "zeros", "all-zero M00", "negative M00"],
)
def test_a_band_that_tells_nothing_is_refused_by_its_wavelength(
    band: int, change: dict[str, float], problem: str
) -> None:
    with pytest.raises(InputError, match=f"made: mueller at {450 + 50 * band} nm: {problem}"):
        pbrdf.fit(changed(made_table(), band, **change), downsample=1)


def test_a_table_without_a_valid_node_is_refused() -> None:
    with pytest.raises(InputError, match="made: mueller at 450 nm: holds nothing but zeros or NaN"):
        pbrdf.fit(changed(made_table(), every=np.nan), downsample=1)


def test_some_negative_m00_is_noise_and_is_counted() -> None:
    result = pbrdf.fit(made_table(noise=0.3), downsample=1)
    assert any("M00 is negative at" in remark and "550 nm" in remark for remark in result.remarks)
    assert abs(result.band(1)["eta"] - 1.5) < 0.05


def test_a_single_lights_slab_near_the_camera_leaves_the_index_open() -> None:
    """At small θd neither polarisation nor angle tells reflectance at the facets from the weight."""
    mirror = [{**parameters, "albedo": 0.0} for parameters in TRUTH]
    table = one_slab(made_table(mirror, noise=1.0), 1)
    result = pbrdf.fit(table, downsample=1, held_out=True)
    words = " ".join((*result.undetermined, *result.bounds_met))
    for nm in (450, 500, 550):
        assert f"eta at {nm} nm is hardly determined" in words or f"eta at {nm} nm ended on" in words
    assert "alpha is" not in words
    assert result.held_out is None
    assert "No slab of θd could be held out: the table has too few" in result.remarks


def test_a_single_lights_slab_at_brewsters_angle_tells_everything() -> None:
    result = pbrdf.fit(one_slab(made_table(noise=0.05), 9), downsample=1)
    assert result.undetermined == ()
    assert largest_error(result) < 0.05


def test_the_second_half_of_a_band_may_be_lost() -> None:
    table = made_table(noise=0.05)
    table.mueller[0, :, 8:] = np.nan
    assert largest_error(pbrdf.fit(table, downsample=1)) < 0.02
