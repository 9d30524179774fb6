from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
import pytest
from numpy.typing import NDArray

from pbrdf.errors import InputError
from pbrdf.formats.mueller_exr import ELEMENTS, read_mueller_exr, write_mueller_exr

ROWS, COLUMNS = 9, 13
ATTRIBUTES = {"material": "gold", "light": "041.00", "band": "550 nm", "units": "DN/s"}
HALF_PRECISION = 2.0**-11
"""Half of the step between neighbouring normal halves, relative."""

Image = tuple[NDArray[np.float32], NDArray[np.float32]]

MISSING = (np.arange(ROWS * COLUMNS) % 4).reshape(ROWS, COLUMNS).astype(np.uint8)


@pytest.fixture
def image() -> Image:
    """Signed elements, and variances that spread over nine decades."""
    rng = np.random.default_rng(11)
    mueller = rng.normal(size=(16, ROWS, COLUMNS)).astype(np.float32)
    variance = 10.0 ** rng.uniform(-12, -3, mueller.shape)
    variance.flat[:2] = (1e-12, 1e-3)
    return mueller, variance.astype(np.float32)


def _written(folder: Path, image: Image, first: tuple[int, int] = (40, 70)) -> Path:
    path = folder / "550nm.exr"
    write_mueller_exr(path, *image, MISSING, first, ATTRIBUTES)
    return path


def _rewritten(path: Path, keep: Any, **header: Any) -> None:
    """Write the file anew with some of its channels and another header."""
    with OpenEXR.File(str(path), separate_channels=True) as old:
        channels = {name: c.pixels.copy() for name, c in old.channels().items() if keep(name)}
        kept = {"type": OpenEXR.scanlineimage, "schema": old.header()["schema"]}
    with OpenEXR.File({**kept, **header}, channels) as new:
        new.write(str(path))


def test_elements_return_to_the_last_bit(tmp_path: Path, image: Image) -> None:
    read = read_mueller_exr(_written(tmp_path, image))
    assert read.mueller.dtype == read.variance.dtype == np.float32
    assert np.array_equal(read.mueller, image[0])
    assert read.first == (40, 70)
    assert {name: read.header[name] for name in ATTRIBUTES} == ATTRIBUTES
    assert read.header["schema"] == "pbrdf/mueller/2"


def test_the_mask_says_why_a_pixel_is_missing(tmp_path: Path, image: Image) -> None:
    read = read_mueller_exr(_written(tmp_path, image))
    assert read.missing.dtype == np.uint8
    assert np.array_equal(read.missing, MISSING)
    assert read.header["maskMeaning"] == "0 none, 1 saturated, 2 hot, 3 no_flat"


@pytest.mark.parametrize("unit", [1e-20, 1e-6, 0.7, 1.0, 1e9])
def test_variances_keep_the_precision_of_a_half_over_nine_decades(
    tmp_path: Path, image: Image, unit: float
) -> None:
    variance = image[1] * np.float32(unit)
    read = read_mueller_exr(_written(tmp_path, (image[0], variance))).variance
    assert variance.max() / variance.min() > 0.999e9
    assert np.abs(read / variance.astype(np.float64) - 1).max() <= HALF_PRECISION + 1e-6


def test_a_variance_of_zero_stays_zero(tmp_path: Path, image: Image) -> None:
    none = np.zeros_like(image[1])
    assert not read_mueller_exr(_written(tmp_path, (image[0], none))).variance.any()


def test_pixels_that_are_unknown_stay_unknown(tmp_path: Path, image: Image) -> None:
    for values in image:
        values[:, 2, 3] = np.nan
    file = read_mueller_exr(_written(tmp_path, image))
    for read, written in zip((file.mueller, file.variance), image, strict=True):
        assert np.array_equal(np.isnan(read), np.isnan(written))


def test_the_data_window_is_the_place_in_the_frame(tmp_path: Path, image: Image) -> None:
    with OpenEXR.File(str(_written(tmp_path, image, (3, 5)))) as file:
        low, high = file.header()["dataWindow"]
    assert tuple(low) == (5, 3)
    assert tuple(high) == (5 + COLUMNS - 1, 3 + ROWS - 1)


def test_an_ordinary_viewer_finds_the_intensity_in_y(tmp_path: Path, image: Image) -> None:
    with OpenEXR.File(str(_written(tmp_path, image)), separate_channels=True) as file:
        channels = file.channels()
        assert np.array_equal(channels["Y"].pixels, image[0][0])
        assert set(channels) == {"Y", "mask", *(f"{k}{e}" for k in "MV" for e in ELEMENTS)}
        assert {channels[f"M{e}"].pixels.dtype for e in ELEMENTS} == {np.dtype(np.float32)}
        assert {channels[f"V{e}"].pixels.dtype for e in ELEMENTS} == {np.dtype(np.float16)}
        for k, name in enumerate(ELEMENTS):
            assert np.array_equal(channels[f"M{name}"].pixels, image[0][k])


def test_the_same_image_gives_the_same_bytes(tmp_path: Path, image: Image) -> None:
    assert _written(tmp_path / "a", image).read_bytes() == _written(tmp_path / "b", image).read_bytes()


@pytest.mark.parametrize(("name", "others"), [("M13", 0), ("V00", 0)])
def test_a_missing_channel_is_named(tmp_path: Path, image: Image, name: str, others: int) -> None:
    path = _written(tmp_path, image)
    _rewritten(path, lambda channel: channel != name)
    with pytest.raises(InputError) as refused:
        read_mueller_exr(path)
    assert (refused.value.source, refused.value.field) == (str(path), name)
    assert f"{others} more" in refused.value.problem


def test_a_picture_of_something_else_is_refused(tmp_path: Path, image: Image) -> None:
    path = _written(tmp_path, image)
    _rewritten(path, lambda channel: channel == "Y")
    with pytest.raises(InputError, match=r"M00: this channel and 32 more are missing"):
        read_mueller_exr(path)


@pytest.mark.parametrize("schema", ["pbrdf/mueller/1", "other"])
def test_another_schema_is_refused(tmp_path: Path, image: Image, schema: str) -> None:
    path = _written(tmp_path, image)
    _rewritten(path, lambda _: True, schema=schema)
    with pytest.raises(InputError, match="schema: is"):
        read_mueller_exr(path)


@pytest.mark.parametrize("header", [{}, {"varianceScale": "large"}])
def test_variances_without_their_scale_are_refused(
    tmp_path: Path, image: Image, header: dict[str, str]
) -> None:
    path = _written(tmp_path, image)
    _rewritten(path, lambda _: True, **header)
    with pytest.raises(InputError, match="varianceScale"):
        read_mueller_exr(path)


@pytest.mark.parametrize("content", [b"", b"not an image", b"\x76\x2f\x31\x01"])
def test_what_is_no_exr_is_refused(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "550nm.exr"
    path.write_bytes(content)
    with pytest.raises(InputError) as refused:
        read_mueller_exr(path)
    assert (refused.value.source, refused.value.field) == (str(path), "file")
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("share", [0.1, 0.5, 0.9, 0.99])
def test_an_image_cut_short_is_refused(tmp_path: Path, image: Image, share: float) -> None:
    path = _written(tmp_path, image)
    content = path.read_bytes()
    path.write_bytes(content[: int(share * len(content))])
    with pytest.raises(InputError, match="is not an OpenEXR image"):
        read_mueller_exr(path)


def test_a_missing_image_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="does not exist; reconstruct"):
        read_mueller_exr(tmp_path / "550nm.exr")


def test_an_encoder_that_fails_leaves_nothing(tmp_path: Path, image: Image) -> None:
    mismatched = (image[0], image[1][:, :-1])
    with pytest.raises(Exception):  # noqa: B017 - whatever the encoder raises
        _written(tmp_path, mismatched)
    assert list(tmp_path.iterdir()) == []
