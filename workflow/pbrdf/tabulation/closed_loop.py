"""The proof of every convention: an exported table, loaded by Mitsuba, beside what was photographed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pbrdf.formats.documents import member, number, numbers, read_document, wavelengths, write_document
from pbrdf.formats.receipt import digest
from pbrdf.instruments.virtual_optics import optics_of
from pbrdf.models.mitsuba_bsdf import MitsubaBsdf
from pbrdf.optics.rusinkiewicz import cosines, directions

Float = NDArray[np.float64]

KIND = "closed_loop/1"
EXPORTS = ("measured", "filled")
"""The exported tables: of measured nodes alone, and with its gaps filled."""

PLACES, SEED = 20_000, 5
LEAST_COSINE, LEAST_THETA_D_DEG = 0.15, 3.0

UNITS = {
    "covered": "1: share of the directions that the table tells",
    "median, p90": "1: of the largest error of an element over the true M00",
    "element_median, element_p90": "1: of each element's error over the true M00, by rows",
}


@dataclass(frozen=True)
class Agreement:
    """How well one band of an exported table tells the original.

    Attributes
    ----------
    covered : float
        Share of the directions for which it holds a value.
    median, p90 : float
        Of the largest error of an element over the true M00, where it does.
    element_median, element_p90 : ndarray, shape (4, 4)
        Of each element's error over the true M00.
    """

    covered: float
    median: float
    p90: float
    element_median: Float
    element_p90: Float

    @classmethod
    def of(cls, found: Float, truth: Float) -> Agreement:
        """Of matrices (n, 4, 4); what the table does not tell is zero, as Mitsuba has it."""
        told = found[:, 0, 0] != 0.0
        if not told.any():
            nothing = np.ones((4, 4))
            return cls(0.0, 1.0, 1.0, nothing, nothing)
        off = np.abs(found[told] - truth[told]) / truth[told, :1, :1]
        median, p90 = np.quantile(off.max(axis=(1, 2)), [0.5, 0.9])
        return cls(float(told.mean()), float(median), float(p90), *np.quantile(off, [0.5, 0.9], axis=0))

    def plain(self) -> dict[str, Any]:
        """As JSON holds it."""
        return {
            "covered": self.covered,
            "median": self.median,
            "p90": self.p90,
            "element_median": self.element_median.ravel().tolist(),
            "element_p90": self.element_p90.ravel().tolist(),
        }

    @classmethod
    def read(cls, path: str | Path, content: Mapping[str, Any], field: str) -> Agreement:
        """Of a document's field; raises `InputError` if a number is missing."""
        covered, median, p90 = (
            number(path, content, f"{field}.{name}") for name in ("covered", "median", "p90")
        )
        sixteen = (
            np.reshape(numbers(path, content, f"{field}.{name}", 16), (4, 4))
            for name in ("element_median", "element_p90")
        )
        return cls(covered, median, p90, *sixteen)


@dataclass(frozen=True)
class ClosedLoop:
    """A material that went around: photographed, tabulated, exported, loaded.

    Attributes
    ----------
    material : str
    truth : str
        What it was made of, in words.
    directions : int
        Number of pairs compared.
    bands : dict
        By band (nm) and export (`EXPORTS`).
    """

    material: str
    truth: str
    directions: int
    bands: dict[int, dict[str, Agreement]]

    def write(self, path: str | Path, inputs: Mapping[str, str]) -> None:
        """Write as a document of schema ``pbrdf/closed_loop/1``."""
        content = {
            "material": self.material,
            "truth": self.truth,
            "directions": self.directions,
            "units": UNITS,
            "bands_nm": {
                str(nm): {export: each.plain() for export, each in exports.items()}
                for nm, exports in self.bands.items()
            },
            "inputs": dict(inputs),
        }
        write_document(path, KIND, content)

    @classmethod
    def read(cls, path: str | Path) -> ClosedLoop:
        """Read what `write` wrote; raises `InputError` if it is damaged."""
        content = read_document(path, KIND)
        bands = {
            nm: {export: Agreement.read(path, content, f"bands_nm.{name}.{export}") for export in EXPORTS}
            for nm, name in wavelengths(path, content, "bands_nm").items()
        }
        material, truth = (str(member(path, content, name)) for name in ("material", "truth"))
        return cls(material, truth, int(number(path, content, "directions")), bands)


def compare_with_truth(
    material: str,
    sphere: dict[str, Any],
    source: str | Path,
    exports: Mapping[str, str | Path],
    document: str | Path,
    bands_nm: tuple[int, ...],
) -> None:
    """Hold exported tables, as Mitsuba's ``measured_polarized`` reads them, against the photographed sphere.

    Parameters
    ----------
    material : str
    sphere : dict
        Its part of the virtual rig's file.
    source : str or Path
        That file, for messages.
    exports : mapping
        By `EXPORTS`, the ``.pbsdf``.
    document : str or Path
        What is written.
    bands_nm : tuple of int
        Bands of the table.

    Raises
    ------
    InputError
        If Mitsuba is not installed, or a file cannot be read.
    """
    truth = optics_of(sphere, source, f"spheres.{material}")
    bins = random_bins(PLACES, SEED)
    to_light, to_camera = directions(*bins)
    loaded = {
        export: MitsubaBsdf({"type": "measured_polarized", "filename": str(path)}, path, "M")
        for export, path in exports.items()
    }
    bands = {}
    for nm in bands_nm:
        original = truth.evaluate(to_light, to_camera, nm)
        bands[nm] = {
            export: Agreement.of(bsdf.evaluate(to_light, to_camera, nm), original)
            for export, bsdf in loaded.items()
        }
    ClosedLoop(material, in_words(sphere), len(to_light), bands).write(
        document, {export: digest([path]) for export, path in exports.items()}
    )


def random_bins(count: int, seed: int) -> tuple[Float, Float, Float]:
    """θh, θd, φd (n,), radians, of `count` places less those too near to the horizon or to θd = 0.

    They are spread evenly over the table's nodes: densely about the highlight, where it is hard to make.
    """
    u, v, w = np.random.default_rng(seed).random((3, count))
    bins = u**2 * np.pi / 2, v * np.pi / 2, (2 * w - 1) * np.pi
    kept = (np.minimum(*cosines(*bins)) > LEAST_COSINE) & (bins[1] > np.radians(LEAST_THETA_D_DEG))
    theta_h, theta_d, phi_d = (part[kept] for part in bins)
    return theta_h, theta_d, phi_d


def in_words(sphere: Mapping[str, Any]) -> str:
    """What a sphere of a rig's file is made of."""
    if "table" in sphere:
        return f"table {Path(sphere['table']).name}"
    if "mitsuba" in sphere:
        told = sphere["mitsuba"]
        one = dict(told if "type" in told else next(iter(told.values())))
        words = [f"Mitsuba's {one.pop('type')}"]
        for name, value in one.items():
            if not isinstance(value, dict):
                words.append(f"{name} {Path(value).name if name == 'filename' else value}")
        return ", ".join(words)
    return f"{sphere['model']}, roughness {sphere['roughness']}"
