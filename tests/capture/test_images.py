from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import OpenEXR
import pytest
from numpy.typing import NDArray

from pbrdf.capture.images import COLUMNS, import_images, lights_of, read_image_settings
from pbrdf.errors import InputError
from pbrdf.formats.capture_store import FrameStore

STATES = [(0, 25 * n, 5 * n, 90) for n in range(16)]
WHOLE = (slice(0, 6), slice(0, 8))


def _pixels(name: str, dtype: str) -> NDArray[Any]:
    rng = np.random.default_rng(list(name.encode()))
    if dtype.startswith("float"):
        return rng.random((6, 8)).astype(dtype)
    return rng.integers(0, np.iinfo(dtype).max, (6, 8), dtype=dtype, endpoint=True)


def _write(path: Path, image: NDArray[Any]) -> None:
    if path.suffix == ".exr":
        header = {"type": OpenEXR.scanlineimage, "compression": OpenEXR.ZIP_COMPRESSION}
        names = "Y" if image.ndim == 2 else "BGRA"[: image.shape[2]]
        planes = np.atleast_3d(image).transpose(2, 0, 1)
        channels = {name: np.ascontiguousarray(plane) for name, plane in zip(names, planes, strict=True)}
        with OpenEXR.File(header, channels) as file:
            file.write(str(path))
    else:
        assert cv2.imwrite(str(path), image)


class Photographs:
    """A folder of images and the rows of its CSV, for a test to spoil."""

    def __init__(self, folder: Path, dtype: str = "uint16", ending: str = "png") -> None:
        self.folder = folder / "photographs"
        self.details = folder / "settings.csv"
        self.capture = folder / "captures/jade"
        self.rows: list[list[str]] = []
        self.folder.mkdir()
        for band in ("450", "550"):
            for index, state in enumerate(STATES):
                for exposure in ("0.01", "0.08"):
                    self._add(f"{band}_{index}_{exposure}.{ending}", dtype, band, state, exposure)
        for exposure in ("0.01", "0.08"):
            for repeat in range(2):
                self._add(f"dark_{repeat}_{exposure}.{ending}", dtype, "dark", (0, 0, 0, 0), exposure)

    def _add(self, name: str, dtype: str, band: str, state: tuple[int, ...], exposure: str) -> None:
        _write(self.folder / name, _pixels(name, dtype))
        self.rows.append([name, "41", band, *map(str, state), exposure])

    def move(self, band: str, to_light: str) -> None:
        """Make the images of a band those of another light in the band that stays."""
        for row in self.rows:
            if row[2] == band:
                row[1], row[2] = to_light, "450"

    def drop(self, *names: str) -> None:
        """Leave out the rows of some images."""
        self.rows = [row for row in self.rows if row[0] not in names]

    def bring_in(self, light: str = "041.00") -> Path:
        with self.details.open("w", newline="", encoding="utf-8") as stream:
            csv.writer(stream).writerows([COLUMNS, *self.rows])
        return import_images(self.folder, self.details, light, "jade", self.capture)

    def refusal(self, light: str = "041.00") -> InputError:
        with pytest.raises(InputError) as refused:
            self.bring_in(light)
        assert "\n" not in str(refused.value)
        assert not self.capture.exists()
        return refused.value


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
                shown = _pixels(f"{band}_{state}_{seconds}.{ending}", dtype)
                assert np.array_equal(frames[state, exposure], shown)


def test_dark_frames_are_those_of_their_exposure(photographs: Photographs) -> None:
    store = FrameStore.open(photographs.bring_in().parent / "frames.zarr")
    assert store.header.darks == 2
    dark = store.mean_dark(*WHOLE)
    for exposure, seconds in enumerate(("0.01", "0.08")):
        pair = [_pixels(f"dark_{repeat}_{seconds}.png", "uint16") for repeat in range(2)]
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
    assert np.array_equal(frames.read_band(450, *WHOLE)[3, 1], _pixels("550_3_0.08.png", "uint16"))


def test_angles_of_one_name_are_one_light(photographs: Photographs) -> None:
    photographs.rows[0][1] = "41.001"
    photographs.bring_in()
    assert lights_of(read_image_settings(photographs.details)) == ["041.00"]


def test_images_that_changed_since_they_were_brought_in_are_refused(photographs: Photographs) -> None:
    photographs.bring_in()
    cv2.imwrite(str(photographs.folder / "450_3_0.08.png"), _pixels("other", "uint16"))
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
    _write(photographs.folder / f"450_3_0.08.{ending}", np.zeros((6, 8, channels), dtype))
    refused = photographs.refusal()
    assert refused.source == str(photographs.folder / f"450_3_0.08.{ending}")
    assert refused.problem == f"has {channels} channels"


def test_a_file_of_several_images_is_refused(tmp_path: Path) -> None:
    tiff = Photographs(tmp_path, "uint16", "tiff")
    cv2.imwritemulti(str(tiff.folder / "450_3_0.08.tiff"), [_pixels(name, "uint16") for name in "abc"])
    assert tiff.refusal().problem == "has 3 images"


def test_an_exr_of_several_images_is_refused(tmp_path: Path) -> None:
    exr = Photographs(tmp_path, "float32", "exr")
    header = {"type": OpenEXR.scanlineimage, "compression": OpenEXR.ZIP_COMPRESSION}
    parts = [OpenEXR.Part(dict(header), {"Y": _pixels(name, "float32")}, name) for name in "ab"]
    OpenEXR.File(parts).write(str(exr.folder / "450_3_0.08.exr"))
    assert exr.refusal().problem == "has 2 images"


@pytest.mark.parametrize(("ending", "dtype"), [("tiff", "float64"), ("tiff", "int16"), ("exr", "uint32")])
def test_an_image_of_a_type_that_no_camera_has_is_refused(tmp_path: Path, ending: str, dtype: str) -> None:
    photographs = Photographs(tmp_path, "float32", ending)
    _write(photographs.folder / f"450_3_0.08.{ending}", np.zeros((6, 8), dtype))
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
    pixels = _pixels(first, "uint16")
    cv2.imwrite(str(photographs.folder / again), pixels, [cv2.IMWRITE_PNG_COMPRESSION, 0])
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
    _write(photographs.folder / "550_5_0.01.png", _pixels("other", "uint16"))
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


@pytest.mark.parametrize("name", ["./450_0_0.01.png", ".//450_0_0.01.png"])
def test_a_file_under_two_names_is_refused(photographs: Photographs, name: str) -> None:
    photographs.rows[5][0] = name
    assert photographs.refusal().problem == "`450_0_0.01.png` stands there twice"


def test_a_doubled_row_is_refused(photographs: Photographs) -> None:
    photographs.rows.append(photographs.rows[5])
    refused = photographs.refusal()
    assert (refused.field, refused.problem) == ("file", f"`{photographs.rows[5][0]}` stands there twice")


def test_two_images_of_the_same_setting_are_refused(photographs: Photographs) -> None:
    photographs.rows.append(["550_3_0.08.png", *photographs.rows[0][1:]])
    photographs.rows = [row for index, row in enumerate(photographs.rows) if index != 39]
    refused = photographs.refusal()
    assert refused.field == "light 041.00, 450 nm, state (0.0, 0.0, 0.0, 90.0), 0.01 s"
    assert refused.problem == "is what line 2 (`450_0_0.01.png`) and line 69 (`550_3_0.08.png`) both show"


def test_a_missing_combination_is_refused(photographs: Photographs) -> None:
    photographs.drop("550_3_0.08.png")
    refused = photographs.refusal()
    assert refused.source == str(photographs.details)
    assert refused.field == "light 041.00, 550 nm, state (0.0, 75.0, 15.0, 90.0), 0.08 s"
    assert refused.problem == (
        "has no image, and line 9 (`450_3_0.08.png`) shows that exposure in "
        "light 041.00, 450 nm, state (0.0, 75.0, 15.0, 90.0), 0.08 s"
    )


def test_a_light_that_lacks_a_state_of_others_is_refused(photographs: Photographs) -> None:
    photographs.move("550", to_light="8")
    photographs.drop("550_3_0.01.png", "550_3_0.08.png")
    for light in ("008.00", "041.00"):
        refused = photographs.refusal(light)
        assert refused.field == "light 008.00, 450 nm, state (0.0, 75.0, 15.0, 90.0), 0.01 s"
        assert refused.problem.startswith("has no image, and line 8 (`450_3_0.01.png`) shows that state")
        assert refused.remedy == "add it, or drop that state everywhere"


def test_a_light_that_lacks_an_exposure_of_others_is_refused(photographs: Photographs) -> None:
    photographs.move("550", to_light="8")
    photographs.drop(*(f"550_{state}_0.08.png" for state in range(16)))
    refused = photographs.refusal("008.00")
    assert refused.field == "light 008.00, 450 nm, state (0.0, 0.0, 0.0, 90.0), 0.08 s"
    assert "line 3 (`450_0_0.08.png`) shows that exposure in light 041.00" in refused.problem


def test_a_light_that_lacks_a_band_of_others_is_refused(photographs: Photographs) -> None:
    for row in photographs.rows:
        if row[2] == "550":
            row[1] = "8"
    refused = photographs.refusal("041.00")
    assert refused.field == "light 041.00, 550 nm, state (0.0, 0.0, 0.0, 90.0), 0.01 s"
    assert "line 34 (`550_0_0.01.png`) shows that band in light 008.00" in refused.problem


def test_an_exposure_of_one_image_alone_is_refused(photographs: Photographs) -> None:
    row = next(row for row in photographs.rows if row[0] == "550_3_0.08.png")
    row[-1] = "0.081"
    refused = photographs.refusal()
    assert "line 41 (`550_3_0.08.png`) shows that exposure" in refused.problem


def test_gaps_are_found_before_an_image_is_read(photographs: Photographs) -> None:
    photographs.drop("550_15_0.08.png")
    for path in photographs.folder.iterdir():
        path.unlink()
    assert photographs.refusal().problem.startswith("has no image")


def test_uneven_dark_frames_are_refused(photographs: Photographs) -> None:
    photographs.rows.pop()
    refused = photographs.refusal()
    assert refused.field == "light 041.00, dark, 0.08 s"
    assert refused.problem == "has 1 frames, and line 67 (`dark_1_0.01.png`) is one of 2 of 0.01 s"


def test_an_exposure_without_dark_frames_is_refused(photographs: Photographs) -> None:
    del photographs.rows[-2:]
    assert photographs.refusal().problem.startswith("has 0 frames")


def test_a_dark_frame_of_a_time_that_no_image_has_is_refused(photographs: Photographs) -> None:
    photographs.rows[-1][-1] = "0.5"
    refused = photographs.refusal()
    assert refused.field == "line 69 (`dark_1_0.08.png`), exposure_s"
    assert refused.problem == "is 0.5, and no image was exposed so long"


@pytest.mark.parametrize("light", ["41", "8"])
def test_dark_frames_alone_are_no_light(photographs: Photographs, light: str) -> None:
    if light == "41":
        photographs.rows = [row for row in photographs.rows if row[2] == "dark"]
    else:
        for row in photographs.rows[-4:]:
            row[1] = light
    refused = photographs.refusal()
    assert refused.field == "band_nm"
    assert f"the light 0{float(light):05.2f} has no other images" in refused.problem


def test_a_light_without_images_is_refused(photographs: Photographs) -> None:
    refused = photographs.refusal("060.00")
    assert "060.00" in refused.problem


@pytest.mark.parametrize("name", ["../secret.png", "/etc/secret.png", "a/../../secret.png", ""])
def test_a_path_that_leaves_the_folder_is_refused(photographs: Photographs, name: str) -> None:
    photographs.rows[2][0] = name
    refused = photographs.refusal()
    assert refused.field == "line 4, file"
    assert repr(name) in refused.problem


@pytest.mark.parametrize(
    ("column", "cell"),
    [
        ("light_deg", "nan"),
        ("light_deg", "-8"),
        ("light_deg", "361"),
        ("band_nm", "red"),
        ("band_nm", "0"),
        ("band_nm", "-450"),
        ("band_nm", "450.5"),
        ("generator_retarder_deg", "inf"),
        ("analyser_polariser_deg", ""),
        ("exposure_s", "0"),
        ("exposure_s", "-1"),
        ("exposure_s", "10 ms"),
    ],
)
def test_a_cell_that_cannot_be_read_is_named(photographs: Photographs, column: str, cell: str) -> None:
    photographs.rows[2][COLUMNS.index(column)] = cell
    assert photographs.refusal().field == f"line 4, {column}"


def test_a_line_cut_short_or_too_long_is_refused(photographs: Photographs) -> None:
    row = photographs.rows[2]
    photographs.rows[2] = row[:-1]
    assert photographs.refusal().field == "line 4, exposure_s"
    photographs.rows[2] = [*row, "again"]
    assert photographs.refusal().field == "line 4"


def test_other_columns_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "settings.csv"
    path.write_text("file,angle\na.png,3\n")
    with pytest.raises(InputError, match="header"):
        read_image_settings(path)


def test_a_table_of_no_images_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "settings.csv"
    path.write_text(",".join(COLUMNS) + "\n")
    with pytest.raises(InputError, match="rows: there are none"):
        read_image_settings(path)


def test_a_missing_table_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"none\.csv: file: does not exist"):
        read_image_settings(tmp_path / "none.csv")


def test_bytes_that_are_no_text_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "settings.csv"
    path.write_bytes(",".join(COLUMNS).encode() + b"\ngr\xfcn.png,41,450,0,0,0,0,1\n")
    with pytest.raises(InputError, match="is not UTF-8"):
        read_image_settings(path)
