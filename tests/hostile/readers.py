"""Every reader of files that come from elsewhere, with a valid example of what it reads."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import OpenEXR
import scipy.io
import yaml

from pbrdf.calibration.documents import KINDS, write_given
from pbrdf.calibration.flat_field import KIND as FLAT
from pbrdf.calibration.flat_field import write_flat
from pbrdf.capture.image_file import read_image
from pbrdf.capture.images import COLUMNS as IMAGE_COLUMNS
from pbrdf.capture.images import read_image_settings
from pbrdf.capture.journal import Journal
from pbrdf.fitting.options import FitOptions
from pbrdf.fitting.residuals import Residuals
from pbrdf.fitting.result import FitResult, FittedParameter, HeldOut, read_fit
from pbrdf.formats.axes_file import read_axes
from pbrdf.formats.band_exr import read_band, write_bands
from pbrdf.formats.capture_store import FramesHeader, FrameStore
from pbrdf.formats.documents import read_any, write_document
from pbrdf.formats.exr_file import write_exr
from pbrdf.formats.kaist_mat import read_kaist_mat
from pbrdf.formats.mueller_exr import read_mueller_exr, write_mueller_exr
from pbrdf.formats.pbsdf import read_pbsdf, write_pbsdf
from pbrdf.formats.receipt import receipt_content
from pbrdf.formats.table_data import TableData
from pbrdf.formats.table_zarr import read_table, write_table
from pbrdf.formats.zarr_claims import MOST_SQUEEZED
from pbrdf.settings.checked import read_checked
from pbrdf.settings.materials import COLUMNS as MATERIAL_COLUMNS
from pbrdf.settings.materials import read_materials
from pbrdf.settings.rig import read_rig
from pbrdf.tabulation.slices import Slice, read_slice, write_slice

ROOT = Path(__file__).resolve().parents[2]
WHOLE = (slice(None), slice(None))


@dataclass(frozen=True)
class Reader:
    """A reader under attack.

    Attributes
    ----------
    name : str
        Of the file or folder that it reads; its ending counts.
    write : callable
        Writes a valid example at a path.
    read : callable
        Reads it.
    squeezed : int
        How many bytes a byte of the file may stand for: more than one where files are compressed.
    """

    name: str
    write: Callable[[Path], object]
    read: Callable[[Path], object]
    squeezed: int = 4


# What DEFLATE and LZ4 can make of one byte at most, and a copy of that
SQUEEZED = 4 * 1032
IN_ZARR = 4 * MOST_SQUEEZED


def _table() -> TableData:
    rng = np.random.default_rng(5)
    return TableData(
        source="example",
        wavelengths_nm=450.0 + 50.0 * np.arange(5),
        theta_h=np.linspace(0, np.pi / 2, 3),
        theta_d=np.linspace(0, np.pi / 2, 2),
        phi_d=np.linspace(-np.pi, np.pi, 3),
        mueller=rng.normal(size=(5, 3, 2, 3, 4, 4)).astype(np.float32),
        count=np.ones((5, 3, 2, 3), np.uint16),
    )


def _write_mat(path: Path) -> None:
    table = _table()
    axes = {name: getattr(table, name)[None] for name in ("theta_h", "theta_d", "phi_d")}
    content = {"wvls": table.wavelengths_nm[None], "pbrdf_T": table.mueller.transpose(3, 2, 1, 0, 4, 5)}
    scipy.io.savemat(path, {**axes, **content}, do_compression=path.stem == "squeezed")


def _write_mueller(path: Path) -> None:
    values = np.random.default_rng(6).normal(size=(16, 3, 4)).astype(np.float32)
    write_mueller_exr(path, values, values**2, np.zeros((3, 4), np.uint8), (5, 6), {"units": "DN/s"})


def _write_frame_image(path: Path) -> None:
    pixels = np.random.default_rng(7).random((5, 4)).astype(np.float32)
    write_exr(path, {"compression": OpenEXR.PIZ_COMPRESSION}, {"Y": pixels})


def _write_encoded(path: Path) -> None:
    import cv2

    cv2.imwrite(str(path), np.random.default_rng(7).integers(0, 2**16, (5, 4)).astype(np.uint16))


def _write_frames(path: Path) -> None:
    header = FramesHeader(
        material="gold",
        light="041.00",
        source="fake",
        angle_deg=41.0,
        bands_nm=(450,),
        states_deg=((0.0, 0.0, 0.0, 90.0), (0.0, 25.0, 5.0, 90.0)),
        exposures_s=(0.005,),
        darks=1,
        rows=3,
        columns=4,
        dtype="uint16",
        adc_bits=14,
        shift=2,
        saturation=65532.0,
    )
    store = FrameStore.create(path, header)
    frame = np.arange(12, dtype=np.uint16).reshape(3, 4)
    for state in range(2):
        store.write_frame(450, state, 0, frame)
    store.write_dark(0, 0, frame)


def _read_frames(path: Path) -> None:
    store = FrameStore.open(path)
    for band_nm in store.header.bands_nm:
        store.read_band(band_nm, *WHOLE)
    store.mean_dark(*WHOLE)


def _write_slice(path: Path) -> None:
    values = np.random.default_rng(8).normal(size=(2, 3, 4, 4, 4)).astype(np.float32)
    write_slice(
        path, Slice(41.0, (450, 550), values, values**2, np.ones((2, 3, 4), np.uint16), np.ones((3, 4)))
    )


def _write_rows(columns: tuple[str, ...], delimiter: str, *rows: str) -> Callable[[Path], object]:
    lines = [delimiter.join(columns), *(row.replace("|", delimiter) for row in rows)]
    return lambda path: path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _write_json(content: Mapping[str, object]) -> Callable[[Path], object]:
    return lambda path: path.write_text(json.dumps(content), encoding="utf-8")


def _write_fit(path: Path) -> None:
    matrix = ((0.1,) * 4,) * 4
    residuals = Residuals((10,), 1.0, (matrix,), (matrix,))
    FitResult(
        model="baek2018",
        source="t.zarr",
        digest="0" * 64,
        wavelengths_nm=(450.0,),
        parameters=(FittedParameter("alpha", "roughness", "1", True, (0.2,), (0.01,)),),
        bounds_met=(),
        undetermined=("alpha is hardly determined",),
        remarks=(),
        residuals=residuals,
        held_out=HeldOut((10.0, 40.0), residuals),
        options=FitOptions(),
        starts=(1.0,),
        evaluations=3,
    ).write(path)


def _calibration(kind: str, content: Mapping[str, object]) -> Reader:
    """Reader of a calibration that somebody gives: it is read and written again beside."""
    return Reader(
        f"{kind}.json",
        _write_json({"schema": f"pbrdf/{KINDS[kind]}", **content}),
        lambda path: write_given(kind, path, path.parent / "taken" / path.name),
    )


def _flat() -> Reader:
    """Reader of a flat field with its image."""
    taken = _calibration("flat", {})

    def write(path: Path) -> None:
        write_document(path, FLAT, write_flat(path, {450: np.ones((4, 5), np.float32)}))

    return replace(taken, write=write)


_AXES = {"theta_h_deg": [0, 45, 90], "theta_d_deg": [0, 90], "phi_d_deg": [-180, 0, 180]}
_JOURNAL = {"frame": "450nm/0/0", "checksum": "00" * 16, "times": {"begin": 1.5}}
_ROWS = [f"{n}.png|30|450|0|{5 * n}|{n}|90|0.08" for n in range(3)]
_POLARIMETER = {
    "zeros_deg": {
        "generator_polariser": 0.1,
        "generator_retarder": 1.0,
        "analyser_retarder": 2.0,
        "analyser_polariser": 0.3,
    },
    "analyser_axis": [1.0, 0.0, 0.0],
    "bands": {"450": {"generator_retardance_deg": 90.0, "analyser_retardance_deg": 91.0}},
}
_ARM = {
    "centre_mm": [0.0, 0.0, 700.0],
    "axis": [0.0, 1.0, 0.0],
    "start": [0.0, 0.0, -1.0],
    "radius_mm": 600.0,
    "generator_axis": [1.0, 0.0, 0.0],
}
_CAMERA = {"focal_px": [800.0, 800.0], "principal_px": [23.6, 23.9], "rows": 48, "columns": 48}

READERS: dict[str, Reader] = {
    "pbsdf": Reader("t.pbsdf", lambda path: write_pbsdf(path, _table()), read_pbsdf),
    "mat": Reader("plain.mat", _write_mat, read_kaist_mat),
    "mat-squeezed": Reader("squeezed.mat", _write_mat, read_kaist_mat, squeezed=SQUEEZED),
    "exr-mueller": Reader("m.exr", _write_mueller, read_mueller_exr),
    "exr-bands": Reader(
        "flat.exr",
        lambda path: write_bands(path, {450: np.ones((4, 5), np.float32)}, {}),
        lambda path: read_band(path, 450),
        squeezed=SQUEEZED,
    ),
    "exr-frame": Reader("f.exr", _write_frame_image, read_image, squeezed=SQUEEZED),
    "png": Reader("f.png", _write_encoded, read_image, squeezed=SQUEEZED),
    "tiff": Reader("f.tiff", _write_encoded, read_image, squeezed=SQUEEZED),
    "zarr-table": Reader(
        "t.zarr", lambda path: write_table(path, _table(), {}), read_table, squeezed=IN_ZARR
    ),
    "zarr-frames": Reader("frames.zarr", _write_frames, _read_frames, squeezed=IN_ZARR),
    "zarr-slice": Reader("030.00.zarr", _write_slice, read_slice, squeezed=IN_ZARR),
    "csv-images": Reader("images.csv", _write_rows(IMAGE_COLUMNS, ",", *_ROWS), read_image_settings),
    "tsv-materials": Reader(
        "materials.tsv",
        _write_rows(MATERIAL_COLUMNS, "\t", "gold|rig|monday|25|-|-", "jade|table|-|-|a.pbsdf|-"),
        read_materials,
    ),
    "json-any": Reader("d.json", _write_json({"schema": "pbrdf/x/1", "a": [1, {"b": 2.5}]}), read_any),
    "json-receipt": Reader(
        "r.json", _write_json({"schema": "pbrdf/receipt/1", "content": "0" * 64}), receipt_content
    ),
    "json-fit": Reader("fit.json", _write_fit, read_fit),
    "json-camera": _calibration("camera", _CAMERA),
    "json-polarimeter": _calibration("polarimeter", _POLARIMETER),
    "json-lights": _calibration("lights", _ARM),
    "json-flat": _flat(),
    "jsonl-journal": Reader(
        "journal.jsonl",
        lambda path: path.write_text(2 * (json.dumps(_JOURNAL) + "\n"), encoding="utf-8"),
        lambda path: Journal(path).checksums(),
    ),
    "yaml-axes": Reader(
        "axes.yaml", lambda path: path.write_text(yaml.safe_dump(_AXES), encoding="utf-8"), read_axes
    ),
    "yaml-rig": Reader(
        "rig.yaml",
        lambda path: path.write_bytes((ROOT / "config/rig/virtual.yaml").read_bytes()),
        read_rig,
    ),
    "yaml-config": Reader(
        "config.yaml",
        lambda path: path.write_bytes((ROOT / "config/config.yaml").read_bytes()),
        lambda path: read_checked(path, "config"),
    ),
}
