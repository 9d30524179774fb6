"""The folder of the report: pages that were written apart, and what they share."""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path

from pbrdf.errors import InputError
from pbrdf.formats.folders import replace_folder
from pbrdf.report.html import TEMPLATES

PLOTLY = "plotly.min.js"
SCRIPT = "report.js"
PANELS = "panels.js"


def assemble_report(
    pages: Sequence[str | Path],
    values: Sequence[str | Path],
    scripts: Sequence[str | Path],
    folder: str | Path,
) -> None:
    """Gather pages and the values behind them in one folder that opens offline.

    Parameters
    ----------
    pages : sequence of paths
        Pages, which find each other by their names.
    values : sequence of paths
        JSON documents that pages lead to; they go to ``values/``.
    scripts : sequence of paths
        Folders of scripts from which pages draw; they go there too.
    folder : str or Path
        Made anew, whole or not at all. Holds Plotly's script once, for all pages.

    Raises
    ------
    InputError
        If Plotly is not installed.
    """
    plotly = plotly_script()
    with replace_folder(Path(folder)) as beside:
        for page in map(Path, pages):
            shutil.copyfile(page, beside / page.name)
        (beside / "values").mkdir()
        for document in map(Path, values):
            shutil.copyfile(document, beside / "values" / document.name)
        for each in map(Path, scripts):
            shutil.copytree(each, beside / "values" / each.name)
        shutil.copyfile(plotly, beside / PLOTLY)
        for script in (SCRIPT, PANELS):
            shutil.copyfile(TEMPLATES / script, beside / script)


def plotly_script() -> Path:
    """Plotly's script, as its Python package brings it; `InputError` where that is not installed."""
    # the package itself takes half a second to import, and only the script is wanted
    found = find_spec("plotly")
    if found is None or found.origin is None:
        raise InputError("report", "plotly", "is not installed", "pip install -r requirements.lock")
    return Path(found.origin).with_name("package_data") / PLOTLY
