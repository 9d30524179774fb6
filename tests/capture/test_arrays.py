from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import pbrdf
from pbrdf.capture.arrays import write_capture
from pbrdf.capture.frames import read_manifest
from pbrdf.errors import InputError
from pbrdf.formats.capture_store import FrameStore

STATES = [(0.0, 25.0 * n, 5.0 * n, 90.0) for n in range(16)]
EXPOSURES = (0.01, 0.08)
SHAPE = (16, 2, 5, 7)
WHOLE = (slice(0, 5), slice(0, 7))


def _frames(dtype: str = "uint16", seed: int = 3, shape: tuple[int, ...] = SHAPE) -> NDArray[Any]:
    rng = np.random.default_rng(seed)
    return (rng.random(shape) * (1 if dtype == "float32" else 250)).astype(dtype)


def _repeats(shape: tuple[int, ...] = (2, 2, 5, 7), dtype: str = "uint16") -> dict[int, NDArray[Any]]:
    return {nm: _frames(dtype, seed=nm + 1, shape=shape) for nm in (450, 650)}


def _arguments(**changes: Any) -> dict[str, Any]:
    arguments = {
        "material": "jade",
        "angle_deg": 41.0,
        "frames": {650: _frames(seed=1), 450: _frames(seed=2)},
        "states_deg": STATES,
        "exposures_s": EXPOSURES,
        "dark": _frames(seed=5, shape=(2, 3, 5, 7)),
    }
    return arguments | changes


def _refusal(folder: Path, **changes: Any) -> InputError:
    before = sorted(folder.rglob("*"))
    with pytest.raises(InputError) as refused:
        write_capture(folder, **_arguments(**changes))
    assert "\n" not in str(refused.value)
    assert sorted(folder.rglob("*")) == before
    return refused.value


def _store(folder: Path, light: str = "041.00") -> FrameStore:
    return FrameStore.open(folder / "lights" / light / "frames.zarr")


def test_the_package_opens_this_door() -> None:
    assert pbrdf.write_capture is write_capture


@pytest.mark.parametrize("dtype", ["uint8", "uint16", "float32"])
def test_frames_return_as_they_were_written(tmp_path: Path, dtype: str) -> None:
    frames = {nm: _frames(dtype, seed=nm) for nm in (650, 450)}
    dark = _frames(dtype, seed=5, shape=(2, 3, 5, 7))
    manifest = write_capture(tmp_path, **_arguments(frames=frames, dark=dark, saturation=200.0))
    assert manifest == tmp_path / "lights/041.00/manifest.json"
    store = _store(tmp_path)
    assert store.header.bands_nm == (450, 650)
    assert store.header.states_deg == tuple(STATES)
    assert store.header.exposures_s == EXPOSURES
    assert (store.header.dtype, store.header.saturation) == (dtype, 200.0)
    for nm in (450, 650):
        band = store.read_band(nm, *WHOLE)
        assert band.dtype == dtype
        assert np.array_equal(band, frames[nm])
    mean = dark.mean(axis=1, dtype=np.float64).astype(np.float32)
    assert np.array_equal(store.mean_dark(*WHOLE), mean)


def test_the_manifest_tells_what_the_frames_are(tmp_path: Path) -> None:
    manifest = read_manifest(
        write_capture(tmp_path, **_arguments(source="another rig", adc_bits=12, shift=4))
    )
    assert manifest["schema"] == "pbrdf/capture/1"
    assert (manifest["material"], manifest["light"], manifest["angle_deg"]) == ("jade", "041.00", 41.0)
    assert (manifest["source"], manifest["adc_bits"], manifest["shift"]) == ("another rig", 12, 4)
    assert manifest["frames"] == (2 * 16 + 3) * 2
    assert manifest["darks"] == 3


@pytest.mark.parametrize(("dtype", "saturation"), [("uint8", 255.0), ("uint16", 65535.0)])
def test_integers_saturate_at_their_largest_value_unless_told(
    tmp_path: Path, dtype: str, saturation: float
) -> None:
    write_capture(tmp_path, **_arguments(frames={550: _frames(dtype)}, dark=None))
    header = _store(tmp_path).header
    assert (header.saturation, header.adc_bits) == (saturation, 8 * np.dtype(dtype).itemsize)


def test_without_dark_frames_the_dark_level_is_zero(tmp_path: Path) -> None:
    write_capture(tmp_path, **_arguments(dark=None))
    dark = _store(tmp_path).mean_dark(slice(1, 3), slice(2, 7))
    assert dark.shape == (2, 2, 5)
    assert not dark.any()


def test_two_lights_lie_side_by_side(tmp_path: Path) -> None:
    write_capture(tmp_path, **_arguments())
    other = _frames(seed=9)
    write_capture(tmp_path, **_arguments(angle_deg=8, frames={550: other}, dark=None))
    assert sorted(path.name for path in (tmp_path / "lights").iterdir()) == ["008.00", "041.00"]
    assert np.array_equal(_store(tmp_path, "008.00").read_band(550, *WHOLE), other)
    assert np.array_equal(_store(tmp_path).read_band(450, *WHOLE), _frames(seed=2))


def test_the_same_frames_may_be_written_again_and_change_nothing(tmp_path: Path) -> None:
    manifest = write_capture(tmp_path, **_arguments())
    before = {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}
    assert write_capture(tmp_path, **_arguments()) == manifest
    assert {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()} == before


def test_a_frame_that_differs_from_the_one_written_before_is_refused(tmp_path: Path) -> None:
    write_capture(tmp_path, **_arguments())
    before = {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}
    frames = {450: _frames(seed=2), 650: _frames(seed=1)}
    frames[650][7, 1, 2, 3] ^= 1
    refused = _refusal(tmp_path, frames=frames)
    assert refused.source == str(tmp_path / "lights/041.00")
    assert refused.field == "650nm/s07/e1"
    assert "contradicts" in refused.problem
    assert {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()} == before


def test_a_dark_frame_that_differs_is_refused(tmp_path: Path) -> None:
    write_capture(tmp_path, **_arguments())
    dark = _frames(seed=5, shape=(2, 3, 5, 7))
    dark[1, 2] += 1
    assert _refusal(tmp_path, dark=dark).field == "dark/e1/r2"


def test_other_states_for_the_same_light_are_refused(tmp_path: Path) -> None:
    write_capture(tmp_path, **_arguments())
    states = [*STATES[:15], (0.0, 1.0, 2.0, 90.0)]
    assert _refusal(tmp_path, states_deg=states).field == "states_deg[15]"


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_frames_that_are_not_finite_are_refused(tmp_path: Path, value: float) -> None:
    frames = _frames("float32")
    frames[3, 1, 0, 6] = value
    refused = _refusal(tmp_path, frames={550: frames}, dark=None, saturation=1.0)
    assert refused.field == "550nm, state 3, exposure 1"
    dark = _frames("float32", shape=(2, 3, 5, 7))
    dark[1, 2, 4, 0] = value
    refused = _refusal(tmp_path, frames={550: _frames("float32")}, dark=dark, saturation=1.0)
    assert refused.field == "dark, exposure 1, repeat 2"


@pytest.mark.parametrize(
    ("changes", "field"),
    [
        ({"frames": {}}, "frames"),
        ({"frames": {550: _frames()[:15]}}, "frames[550]"),
        ({"frames": {550: _frames()[:, :1]}}, "frames[550]"),
        ({"frames": {550: _frames()[:, 0]}}, "frames[550]"),
        ({"frames": {550: _frames()[..., :0]}}, "frames[550]"),
        ({"frames": {450: _frames(), 550: _frames()[..., :6]}}, "frames[550]"),
        ({"frames": {450: _frames(), 550: _frames("uint8")}}, "frames[550]"),
        ({"frames": {550: _frames().astype("float64")}}, "frames[550]"),
        ({"frames": {550: _frames().astype("int32")}}, "frames[550]"),
        ({"frames": {550: _frames() > 7}}, "frames[550]"),
        ({"frames": {550.5: _frames()}}, "frames[550.5]"),
        ({"frames": {"550": _frames()}}, "frames['550']"),
        ({"dark": _frames("uint8", shape=(2, 3, 5, 7))}, "dark"),
        ({"dark": _frames(shape=(1, 3, 5, 7))}, "dark"),
        ({"dark": _frames(shape=(2, 3, 7, 5))}, "dark"),
        ({"dark": _frames(shape=(2, 5, 7))}, "dark"),
        ({"states_deg": [state[:3] for state in STATES]}, "states_deg"),
        ({"states_deg": [*STATES[:15], (0, 0)]}, "states_deg"),
        ({"states_deg": STATES[0]}, "states_deg"),
        ({"states_deg": []}, "states_deg"),
        ({"states_deg": [*STATES[:15], (0.0, np.nan, 0.0, 90.0)]}, "states_deg[15]"),
        ({"states_deg": "crossed"}, "states_deg"),
        ({"exposures_s": (0.08, 0.01)}, "exposures_s"),
        ({"exposures_s": (0.01, 0.01)}, "exposures_s"),
        ({"exposures_s": (0.0, 0.01)}, "exposures_s"),
        ({"exposures_s": (0.01, np.nan)}, "exposures_s"),
        ({"exposures_s": (0.01, np.inf)}, "exposures_s"),
        ({"exposures_s": ()}, "exposures_s"),
        ({"angle_deg": np.nan}, "angle_deg"),
        ({"angle_deg": -8.0}, "angle_deg"),
        ({"angle_deg": 1000.0}, "angle_deg"),
        ({"material": "../jade"}, "material"),
        ({"material": "<script>"}, "material"),
        ({"saturation": np.nan}, "saturation"),
        ({"saturation": 0.0}, "saturation"),
        ({"adc_bits": 14, "shift": 3}, "adc_bits"),
        ({"adc_bits": 0}, "adc_bits"),
        ({"shift": -1}, "adc_bits"),
        ({"references": _repeats()}, "references[450]"),
        ({"references_after": (8, 16)}, "references"),
        ({"references": {450: _repeats()[450]}, "references_after": (8, 16)}, "references"),
        ({"references": {**_repeats(), 550: _repeats()[450]}, "references_after": (8, 16)}, "references"),
        ({"references": _repeats(), "references_after": (16,)}, "references[450]"),
        ({"references": _repeats(dtype="uint8"), "references_after": (8, 16)}, "references[450]"),
        ({"references": _repeats((2, 1, 5, 7)), "references_after": (8, 16)}, "references[450]"),
        ({"references": _repeats((2, 2, 7, 5)), "references_after": (8, 16)}, "references[450]"),
        ({"references": _repeats(), "references_after": (16, 8)}, "references_after"),
        ({"references": _repeats(), "references_after": (8, 8)}, "references_after"),
        ({"references": _repeats(), "references_after": (-1, 8)}, "references_after"),
        (
            {"references": _repeats(), "references_after": (8, 16), "reference_state": 16},
            "reference_state",
        ),
        (
            {"references": _repeats(), "references_after": (8, 16), "reference_state": 1.0},
            "reference_state",
        ),
        ({"reference_state": 1}, "reference_state"),
        ({"references": _repeats(), "references_after": (8, 17)}, "references_after"),
        ({"references": _repeats(), "references_after": (8.0, 16.0)}, "references_after"),
    ],
)
def test_what_is_not_as_described_is_refused_and_nothing_written(
    tmp_path: Path, changes: dict[str, Any], field: str
) -> None:
    refused = _refusal(tmp_path, **changes)
    assert refused.source == "write_capture"
    assert refused.field == field


def test_float_frames_without_saturation_are_refused(tmp_path: Path) -> None:
    refused = _refusal(tmp_path, frames={550: _frames("float32")}, dark=None)
    assert refused.field == "saturation"


def test_repeats_of_the_first_state_return_as_they_were_written(tmp_path: Path) -> None:
    arguments = _arguments(references=_repeats(), references_after=(8, 16))
    manifest = read_manifest(write_capture(tmp_path, **arguments))
    assert manifest["references"] == [8, 16]
    assert manifest["frames"] == (2 * (16 + 2) + 3) * 2
    store = _store(tmp_path)
    assert store.header.references == (8, 16)
    for nm in (450, 650):
        assert np.array_equal(np.stack(list(store.read_references(nm, *WHOLE))), _repeats()[nm])
    store.require_complete()


def test_a_repeat_that_differs_is_refused(tmp_path: Path) -> None:
    write_capture(tmp_path, **_arguments(references=_repeats(), references_after=(8, 16)))
    other = _repeats()
    other[650][1, 0, 4, 6] ^= 1
    refused = _refusal(tmp_path, references=other, references_after=(8, 16))
    assert refused.field == "650nm/r01/e0"
    assert "contradicts" in refused.problem


def test_repeats_that_are_not_finite_are_refused(tmp_path: Path) -> None:
    repeats = {550: _frames("float32", shape=(1, 2, 5, 7))}
    repeats[550][0, 1, 2, 3] = np.nan
    refused = _refusal(
        tmp_path,
        frames={550: _frames("float32")},
        dark=None,
        saturation=1.0,
        references=repeats,
        references_after=(16,),
    )
    assert refused.field == "550nm_reference, reference 0, exposure 1"
