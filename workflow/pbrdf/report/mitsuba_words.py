"""Which files for Mitsuba hold which bands, for a material's page."""

from __future__ import annotations

from collections.abc import Sequence

from pbrdf.tabulation.export import band_groups


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
