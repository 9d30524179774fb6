from __future__ import annotations

from pathlib import Path
from typing import Any

import cv2
import numpy as np
import OpenEXR
import pytest
from image_folder import STATES, WHOLE, Photographs, pixels, write_image
from numpy.typing import NDArray

from pbrdf.capture.images import lights_of, read_image_settings
from pbrdf.errors import InputError
from pbrdf.formats.capture_store import FrameStore


@pytest.fixture
def photographs(tmp_path: Path) -> Photographs:
    return Photographs(tmp_path)


@pytest.mark.parametrize(
    ("dtype", "ending", "saturation"),
    [
        ("uint8", "png", 255.0),
        ("uint16", "png", 65535.0),
        ("uint16", "tiff", 65535.0),
        ("float32", "tiff", 1.0),
        ("float32", "exr", 1.0),
        ("float16", "exr", 1.0),
    ],
)
def test_images_become_a_capture(tmp_path: Path, dtype: str, ending: str, saturation: float) -> None:
    photographs = Photographs(tmp_path, dtype, ending)
    manifest = photographs.bring_in()
    assert manifest == photographs.capture / "lights/041.00/manifest.json"
    store = FrameStore.open(manifest.parent / "frames.zarr")
    stored = "float32" if dtype == "float16" else dtype
    assert (store.header.dtype, store.header.saturation) == (stored, saturation)
    assert (store.header.source, store.header.angle_deg) == ("images", 41.0)
    assert store.header.exposures_s == (0.01, 0.08)
    assert store.header.states_deg == tuple(tuple(map(float, state)) for state in STATES)
    for band in (450, 550):
        frames = store.read_band(band, *WHOLE)
        for state in range(16):
            for exposure, seconds in enumerate(("0.01", "0.08")):
                shown = pixels(f"{band}_{state}_{seconds}.{ending}", dtype)
                assert np.array_equal(frames[state, exposure], shown)


def test_dark_frames_are_those_of_their_exposure(photographs: Photographs) -> None:
    store = FrameStore.open(photographs.bring_in().parent / "frames.zarr")
    assert store.header.darks == 2
    dark = store.mean_dark(*WHOLE)
    for exposure, seconds in enumerate(("0.01", "0.08")):
        pair = [pixels(f"dark_{repeat}_{seconds}.png", "uint16") for repeat in range(2)]
        assert np.array_equal(dark[exposure], np.mean(pair, axis=0, dtype=np.float64).astype(np.float32))


def test_the_order_of_the_lines_says_nothing_of_bands_and_exposures(photographs: Photographs) -> None:
    photographs.rows.sort(key=lambda row: (-float(row[-1]), row[2] != "550", int(row[5])))
    header = FrameStore.open(photographs.bring_in().parent / "frames.zarr").header
    assert header.bands_nm == (450, 550)
    assert header.exposures_s == (0.01, 0.08)


def test_dark_frames_may_be_left_out(photographs: Photographs) -> None:
    photographs.rows = [row for row in photographs.rows if row[2] != "dark"]
    assert FrameStore.open(photographs.bring_in().parent / "frames.zarr").header.darks == 0


def test_every_light_has_its_own_images(photographs: Photographs) -> None:
    photographs.move("550", to_light="8.004")
    photographs.bring_in("041.00")
    assert lights_of(read_image_settings(photographs.details)) == ["008.00", "041.00"]
    frames = FrameStore.open(photographs.bring_in("008.00").parent / "frames.zarr")
    assert np.array_equal(frames.read_band(450, *WHOLE)[3, 1], pixels("550_3_0.08.png", "uint16"))


def test_angles_of_one_name_are_one_light(photographs: Photographs) -> None:
    photographs.rows[0][1] = "41.001"
    photographs.bring_in()
    assert lights_of(read_image_settings(photographs.details)) == ["041.00"]


def test_images_that_changed_since_they_were_brought_in_are_refused(photographs: Photographs) -> None:
    photographs.bring_in()
    cv2.imwrite(str(photographs.folder / "450_3_0.08.png"), pixels("other", "uint16"))
    with pytest.raises(InputError, match=r"450nm/s03/e1: contradicts"):
        photographs.bring_in()


def test_a_missing_image_is_refused(photographs: Photographs) -> None:
    (photographs.folder / "450_3_0.08.png").unlink()
    refused = photographs.refusal()
    assert refused.source == str(photographs.folder / "450_3_0.08.png")
    assert refused.problem == "does not exist"


def test_a_file_that_is_no_image_is_refused(photographs: Photographs) -> None:
    (photographs.folder / "450_3_0.08.png").write_text("not an image")
    refused = photographs.refusal()
    assert refused.source == str(photographs.folder / "450_3_0.08.png")
    assert refused.problem == "cannot be decoded"


@pytest.mark.parametrize(
    ("name", "image"),
    [
        ("450_3_0.08.png", np.zeros((6, 9), np.uint16)),
        ("450_3_0.08.png", np.zeros((6, 8), np.uint8)),
        ("550_3_0.08.png", np.zeros((7, 8), np.uint16)),
        ("dark_1_0.08.png", np.zeros((6, 9), np.uint16)),
    ],
)
def test_an_image_of_another_size_or_depth_is_refused(
    photographs: Photographs, name: str, image: NDArray[Any]
) -> None:
    cv2.imwrite(str(photographs.folder / name), image)
    refused = photographs.refusal()
    line = [row[0] for row in photographs.rows].index(name) + 2
    assert (refused.source, refused.field) == (str(photographs.details), f"line {line} (`{name}`)")
    problem = f"is {image.dtype} {image.shape} where `450_0_0.01.png` is uint16 (6, 8)"
    assert refused.problem == problem


def test_a_light_whose_images_are_of_another_size_than_those_of_others_is_refused(
    photographs: Photographs,
) -> None:
    photographs.move("550", to_light="8")
    for path in photographs.folder.glob("550_*.png"):
        cv2.imwrite(str(path), np.zeros((6, 9), np.uint16))
    assert photographs.refusal("008.00").field == "line 34 (`550_0_0.01.png`)"


@pytest.mark.parametrize("channels", [3, 4])
@pytest.mark.parametrize(("ending", "dtype"), [("png", "uint16"), ("tiff", "uint8"), ("exr", "float32")])
def test_a_colour_image_is_refused(tmp_path: Path, ending: str, dtype: str, channels: int) -> None:
    photographs = Photographs(tmp_path, dtype, ending)
    write_image(photographs.folder / f"450_3_0.08.{ending}", np.zeros((6, 8, channels), dtype))
    refused = photographs.refusal()
    assert refused.source == str(photographs.folder / f"450_3_0.08.{ending}")
    assert refused.problem == f"has {channels} channels"


def test_a_file_of_several_images_is_refused(tmp_path: Path) -> None:
    tiff = Photographs(tmp_path, "uint16", "tiff")
    cv2.imwritemulti(str(tiff.folder / "450_3_0.08.tiff"), [pixels(name, "uint16") for name in "abc"])
    assert tiff.refusal().problem == "has 3 images"


def test_an_exr_of_several_images_is_refused(tmp_path: Path) -> None:
    exr = Photographs(tmp_path, "float32", "exr")
    header = {"type": OpenEXR.scanlineimage, "compression": OpenEXR.ZIP_COMPRESSION}
    parts = [OpenEXR.Part(dict(header), {"Y": pixels(name, "float32")}, name) for name in "ab"]
    OpenEXR.File(parts).write(str(exr.folder / "450_3_0.08.exr"))
    assert exr.refusal().problem == "has 2 images"


@pytest.mark.parametrize(("ending", "dtype"), [("tiff", "float64"), ("tiff", "int16"), ("exr", "uint32")])
def test_an_image_of_a_type_that_no_camera_has_is_refused(tmp_path: Path, ending: str, dtype: str) -> None:
    photographs = Photographs(tmp_path, "float32", ending)
    write_image(photographs.folder / f"450_3_0.08.{ending}", np.zeros((6, 8), dtype))
    assert photographs.refusal().problem == f"is {dtype}"


@pytest.mark.parametrize(("ending", "dtype"), [("png", "uint16"), ("tiff", "uint16"), ("exr", "float32")])
def test_an_image_cut_short_is_refused(tmp_path: Path, ending: str, dtype: str) -> None:
    photographs = Photographs(tmp_path, dtype, ending)
    path = photographs.folder / f"450_3_0.08.{ending}"
    path.write_bytes(path.read_bytes()[:-40])
    refused = photographs.refusal()
    assert (refused.source, refused.problem) == (str(path), "cannot be decoded")


@pytest.mark.parametrize(
    ("again", "first"),
    [
        ("550_3_0.08.png", "450_3_0.08.png"),
        ("450_4_0.01.png", "450_0_0.08.png"),
        ("dark_1_0.01.png", "550_2_0.01.png"),
        ("dark_1_0.01.png", "dark_0_0.01.png"),
    ],
)
def test_the_same_pixels_for_two_settings_are_refused(
    photographs: Photographs, again: str, first: str
) -> None:
    # Another compression, so that the files differ.
    image = pixels(first, "uint16")
    cv2.imwrite(str(photographs.folder / again), image, [cv2.IMWRITE_PNG_COMPRESSION, 0])
    line = {row[0]: number for number, row in enumerate(photographs.rows, start=2)}
    refused = photographs.refusal()
    assert (refused.source, refused.field) == (str(photographs.details), f"line {line[again]} (`{again}`)")
    assert refused.problem == f"has the very pixels of line {line[first]} (`{first}`)"


def test_the_pixels_of_another_light_are_refused(photographs: Photographs) -> None:
    photographs.move("550", to_light="8")
    copied = photographs.folder / "450_3_0.08.png"
    (photographs.folder / "550_5_0.01.png").write_bytes(copied.read_bytes())
    photographs.bring_in("041.00")
    with pytest.raises(InputError, match=r"has the very pixels of 450nm/s03/e1 of the light 041\.00"):
        photographs.bring_in("008.00")
    assert not (photographs.capture / "lights/008.00").exists()
    write_image(photographs.folder / "550_5_0.01.png", pixels("other", "uint16"))
    assert photographs.bring_in("008.00").exists()
    assert photographs.bring_in("041.00").exists(), "a light is no copy of itself"


def test_a_light_that_the_table_no_longer_names_does_not_count(photographs: Photographs) -> None:
    photographs.bring_in("041.00")
    for row in photographs.rows:
        row[1] = "42"
    assert photographs.bring_in("042.00").exists()


def test_frames_dark_or_saturated_throughout_may_be_alike(photographs: Photographs) -> None:
    bright = np.full((6, 8), 65535, np.uint16)
    hot = np.zeros((6, 8), np.uint16)
    hot[2, 3] = 65535
    for name, image in (("450_3_0.08", bright), ("450_4_0.08", bright), ("550_3_0.08", bright)):
        cv2.imwrite(str(photographs.folder / f"{name}.png"), image)
    for repeat in range(2):
        for exposure in ("0.01", "0.08"):
            cv2.imwrite(str(photographs.folder / f"dark_{repeat}_{exposure}.png"), hot)
    store = FrameStore.open(photographs.bring_in().parent / "frames.zarr")
    assert store.mean_dark(*WHOLE).max() == 65535
