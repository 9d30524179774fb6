"""Tables sent out to Mitsuba, which reads exactly five bands a file."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from pbrdf.errors import InputError
from pbrdf.formats.folders import replace_folder
from pbrdf.formats.pbsdf import MITSUBA_BANDS, write_pbsdf
from pbrdf.formats.table_zarr import read_table, read_wavelengths
from pbrdf.reconstruction.physicality import nearest_physical
from pbrdf.tabulation.fill import measured_only


def band_groups(count: int) -> list[slice]:
    """Bands of each file, ascending, five a file.

    The last file of a number that five does not divide takes the last five bands, some of which the file
    before it holds too: nothing is made up. Fewer than five bands make no file.
    """
    starts = list(range(0, count - MITSUBA_BANDS + 1, MITSUBA_BANDS))
    if starts and count % MITSUBA_BANDS:
        starts.append(count - MITSUBA_BANDS)
    return [slice(start, start + MITSUBA_BANDS) for start in starts]


def export_pbsdf(path: str | Path, raw: str | Path, filled: str | Path, *, project: bool) -> None:
    """Write a table of five bands as two ``.pbsdf``: measured nodes only, and with its gaps filled.

    Parameters
    ----------
    path : str or Path
        The table.
    raw, filled : str or Path
        What is written.
    project : bool
        Whether the matrices of the filled one become the nearest physical ones; the table and the raw file
        keep them as they were measured.

    Raises
    ------
    InputError
        If the table cannot be read, or Mitsuba could not load the result.
    """
    _export(path, slice(None), raw, filled, project=project)


def export_groups(path: str | Path, folder: str | Path, *, material: str, project: bool) -> None:
    """Write a table of more than five bands as pairs of ``.pbsdf`` with five bands each.

    Parameters
    ----------
    path : str or Path
        The table.
    folder : str or Path
        Takes ``<material>_<first>-<last>nm.pbsdf`` and ``…_filled.pbsdf`` of each group of bands.
    material : str
        Its name.
    project : bool
        As for `export_pbsdf`.

    Raises
    ------
    InputError
        As `export_pbsdf`, and if there are fewer than five bands.
    """
    wavelengths = read_wavelengths(path)
    groups = band_groups(len(wavelengths))
    if not groups:
        problem = f"has {len(wavelengths)} bands where Mitsuba reads exactly {MITSUBA_BANDS}"
        raise InputError(path, "wavelength", problem, f"photograph at least {MITSUBA_BANDS} bands")
    with replace_folder(folder) as beside:
        for group in groups:
            first, last = np.round(wavelengths[group][[0, -1]]).astype(int)
            name = f"{material}_{first}-{last}nm"
            pair = (beside / f"{name}.pbsdf", beside / f"{name}_filled.pbsdf")
            _export(path, group, *pair, project=project)


def _export(path: str | Path, bands: slice, raw: str | Path, filled: str | Path, *, project: bool) -> None:
    table = read_table(path, bands=bands, variance=False)
    write_pbsdf(raw, measured_only(table))
    if project:
        nearest_physical(table.mueller, out=table.mueller)
    write_pbsdf(filled, table)
