"""How far measurements of one matrix disagree, and which files hold which bands, for a material's page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from pbrdf.tabulation.export import band_groups

NAMES = {"mirror": "mirror image, −φd", "exchange": "light and camera exchanged, φd ± 180°"}


def consistency_view(content: Mapping[str, Any]) -> dict[str, Any] | None:
    """Rows of the table of symmetries, from a document ``pbrdf/consistency/1``.

    Returns
    -------
    dict or None
        `pooled`, and a row for each symmetry and band; None where no two measurements can be compared.
    """
    rows = [
        {
            "name": NAMES[kind],
            "band": f"{band} nm",
            "pairs": told["pairs"],
            "m00_percent": 100 * told["relative"][0],
            "other_percent": 100 * max(told["relative"][1:]),
            "standard_errors": _root_mean_square(told["standard_errors"]),
        }
        for kind in NAMES
        for band, told in content[kind]["by_band_nm"].items()
        if told["pairs"] and None not in told["relative"]
    ]
    return {"pooled": content["pooled"], "rows": rows} if rows else None


def mitsuba_words(name: str, wavelengths: Sequence[float]) -> str | None:
    """Where the bands of a table go that are not five, which is what Mitsuba reads a file; else None."""
    count = len(wavelengths)
    groups = band_groups(count)
    if len(groups) == 1 and count == len(wavelengths[groups[0]]):
        return None
    words = "Mitsuba reads exactly five bands a file. "
    if not groups:
        return words + f"This table has {count}, and none are made up: nothing is written for Mitsuba."
    first, last = (f"{wavelengths[groups[0]][end]:.0f}" for end in (0, -1))
    words += f"The folder pbsdf holds {len(groups)} pairs of files (measured nodes, and filled) of five "
    words += f"ascending bands, the first {name}_{first}-{last}nm.pbsdf."
    twice = wavelengths[groups[-1].start : groups[-2].stop]
    if len(twice):
        listed = ", ".join(f"{nm:g}" for nm in twice)
        words += f" The last file takes the last five bands: {listed} nm are in the file before it too."
    return words


def _root_mean_square(values: Sequence[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return (sum(value**2 for value in known) / len(known)) ** 0.5 if known else None
