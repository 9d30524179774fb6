"""Any file of the project in a few lines: what it is, shape, units, ranges, coverage, what made it."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pbrdf.errors import InputError
from pbrdf.formats.documents import read_any
from pbrdf.models.table import open_table
from pbrdf.report.figures import number
from pbrdf.report.plain_summary import PLAIN
from pbrdf.report.summary import document_summary, table_summary

KINDS = ", ".join((".zarr", ".pbsdf", ".mat", ".exr", ".json", ".jsonl", *PLAIN))


def file_summary(path: str | Path, axes: str | Path | None = None) -> dict[str, str]:
    """Tell what a file of the project holds, by name.

    Parameters
    ----------
    path : str or Path
        A table (``.zarr``, ``.pbsdf``, ``.mat``), a slice or the frames of a light (``.zarr``), a Mueller
        image or flat field (``.exr``), a document (``.json``), a journal (``.jsonl``), rows of values
        (``.csv``), a page (``.html``), a script of the pages (``.js``) or a picture (``.png``,
        ``.svg``, ``.pdf``).
    axes : str or Path, optional
        File of the axes of a table that lacks them.

    Raises
    ------
    InputError
        If the file is of no such kind, or cannot be read.
    """
    path = Path(path)
    if not path.exists():
        raise InputError(path, "file", "is not there", "check the path")
    if path.suffix == ".json":
        return document_summary(path)
    if path.suffix == ".jsonl":
        return _journal(path)
    if path.suffix == ".exr":
        return _image(path)
    if path.suffix in PLAIN:
        return PLAIN[path.suffix](path)
    schema = _zarr_schema(path) if path.suffix == ".zarr" else ""
    if schema.startswith("pbrdf/frames/"):
        return _frames(path)
    if schema.startswith("pbrdf/slice/"):
        return _slice(path) | _receipt(path)
    if schema.startswith("pbrdf/share/"):
        return _share(path) | _receipt(path)
    if path.suffix in (".zarr", ".pbsdf", ".mat"):
        return table_summary(open_table(path, axes).data) | _receipt(path)
    raise InputError(path, "file", f"is of the unknown kind {path.suffix!r}", f"give one of {KINDS}")


def _zarr_schema(path: Path) -> str:
    """Schema that a Zarr store names; none where its metadata cannot be read."""
    try:
        attributes = json.loads((path / "zarr.json").read_text(encoding="utf-8")).get("attributes", {})
    except (OSError, ValueError, AttributeError):
        return ""
    return str(attributes.get("schema", "")) if isinstance(attributes, Mapping) else ""


def _receipt(path: Path) -> dict[str, str]:
    """What the receipt beside a result tells of how it was made; nothing where there is none."""
    # Mueller images of all bands lie in a folder with one receipt
    result = path.parent if path.suffix == ".exr" else path.with_suffix("")
    receipt = result.with_name(f"{result.name}.json")
    if path.suffix not in (".zarr", ".exr") or not receipt.is_file():
        return {}
    content = read_any(receipt)
    if not str(content.get("schema")).startswith("pbrdf/receipt/"):
        return {}
    told = {f"made from {role}": str(value) for role, value in dict(content.get("inputs", {})).items()}
    told |= {f"made with {name}": str(value) for name, value in dict(content.get("settings", {})).items()}
    return {"content (SHA-256)": str(content.get("content")), **told}


def _frames(path: Path) -> dict[str, str]:
    from pbrdf.formats.capture_store import FrameStore

    header = FrameStore.open(path).header
    counts = (len(header.states_deg), len(header.exposures_s))
    return {
        "kind": "frames of a light",
        "material, light": f"{header.material}, {header.light} ({number(header.angle_deg)}°)",
        "made by": header.source,
        "shape": f"{len(header.bands_nm)} bands × {counts[0]} states × {counts[1]} exposures × "
        f"{header.rows} × {header.columns} px",
        "bands": _list(header.bands_nm, "nm"),
        "exposures": _list([1e3 * t for t in header.exposures_s], "ms"),
        "type": f"{header.dtype}, {header.adc_bits} bits, shifted left by {header.shift}",
        "saturated from": f"{number(header.saturation, 5)} DN",
        "dark frames": f"{header.darks} an exposure",
        "repeats of a state": f"{len(header.references)} of state {header.reference_state}",
    }


def _slice(path: Path) -> dict[str, str]:
    from pbrdf.tabulation.slices import read_slice

    part = read_slice(path)
    bands, halves, azimuths = part.mueller.shape[:3]
    differences = np.degrees(part.theta_d[np.isfinite(part.theta_d)])
    return {
        "kind": "slice of a table: what one light says of it",
        "light": f"{number(part.angle_deg, 5)}°",
        "shape": f"{bands} bands × {halves} θh × {azimuths} φd × 4 × 4",
        "bands": _list(part.bands_nm, "nm"),
        "θd": _range(differences, "°"),
        "M00": _range(part.mueller[..., 0, 0], "1/sr"),
        "seen": f"{number(100 * float(np.mean(part.count > 0)))} % of the nodes",
    }


def _share(path: Path) -> dict[str, str]:
    from pbrdf.tabulation.shares import ShareFile

    share = ShareFile(path)
    counts = [share.band(index)[2] for index in range(len(share.bands_nm))]
    return {
        "kind": "share of a table: the nodes that one light gives, by the supplement's map",
        "light": f"{number(share.angle_deg, 5)}°",
        "shape": f"{len(share.bands_nm)} bands × {len(share.nodes)} nodes × 4 × 4, "
        f"of a table of {' × '.join(map(str, share.shape))}",
        "bands": _list(share.bands_nm, "nm"),
        "seen": f"{number(100 * float(np.mean(np.stack(counts) > 0)))} % of the nodes",
    }


def _image(path: Path) -> dict[str, str]:
    import OpenEXR

    try:
        with OpenEXR.File(str(path), separate_channels=True) as image:
            header = dict(image.header())
            pixels = {name: channel.pixels for name, channel in image.channels().items()}
    except (RuntimeError, ValueError) as error:
        raise InputError(path, "file", f"is not an OpenEXR image ({error})", "make it again") from None
    channels = sorted(pixels)
    texts = {name: value for name, value in header.items() if isinstance(value, str)}
    if str(header.get("schema", "")).startswith("pbrdf/mueller"):
        return {"kind": "Mueller image", **_mueller_image(path), **texts, **_receipt(path)}
    lines = {"kind": "image a band" if all(n.endswith("nm") for n in channels) else "OpenEXR image"}
    rows, columns = next(iter(pixels.values())).shape[:2]
    lines["shape"] = f"{len(channels)} × {rows} × {columns} px"
    unit = texts.get("units", "")
    return lines | {name: _range(pixels[name].astype(np.float64), unit) for name in channels} | texts


def _mueller_image(path: Path) -> dict[str, str]:
    from pbrdf.formats.mueller_exr import read_mueller_exr

    image = read_mueller_exr(path)
    rows, columns = image.mueller.shape[1:]
    unit = str(image.header.get("units", ""))
    known = np.isfinite(image.mueller).all(axis=0)
    errors = np.sqrt(image.variance[0][known]) / image.mueller[0][known]
    return {
        "shape": f"4 × 4 × {rows} × {columns} px, from row {image.first[0]}, column {image.first[1]}",
        "M00": _range(image.mueller[0], unit),
        "known": f"{number(100 * float(known.mean()))} % of the pixels",
        "standard error of M00": f"{number(100 * float(np.median(errors)))} %, median"
        if errors.size
        else "–",
    }


def _journal(path: Path) -> dict[str, str]:
    # a capture may be at work: its reader would cut off the line that is being written
    whole = path.read_bytes().rpartition(b"\n")[0]
    try:
        entries = [dict(json.loads(line)) for line in whole.splitlines()]
    except (ValueError, TypeError) as error:
        raise InputError(path, "line", f"cannot be read ({error})", "take that light again") from None
    lines = {"kind": "journal of a light", "frames": str(len(entries))}
    if entries:
        lines |= {"first": str(entries[0].get("frame")), "last": str(entries[-1].get("frame"))}
        lines["of each frame"] = ", ".join(entries[-1])
    return lines


def _list(values: Any, unit: str) -> str:
    return ", ".join(number(float(value), 5) for value in values) + f" {unit}"


def _range(values: NDArray[np.floating], unit: str) -> str:
    known = values[np.isfinite(values)]
    if not known.size:
        return "nothing known"
    return f"{number(float(known.min()))} … {number(float(known.max()))} {unit}"
