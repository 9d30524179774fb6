"""Draw reports/picture.png from a finished default run: photographs, Mueller image, table and fit of gold.

Run by ``make picture``.
"""

from __future__ import annotations

from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray

from pbrdf.fitting import read_fit
from pbrdf.formats.capture_store import FrameStore
from pbrdf.formats.mueller_exr import read_mueller_exr
from pbrdf.formats.table_zarr import read_table
from pbrdf.report.fit_view import model_at
from pbrdf.report.scales import Scale, signed_gamma

ROOT = Path(__file__).resolve().parents[1]
LIGHT, BAND, THETA_D = "080.00", "650nm", 40.0
ELEMENTS = ((0, 0), (0, 1), (1, 1), (2, 2), (2, 3), (3, 3))

Float = NDArray[np.floating]


def short_exposures() -> Float:
    """Frames (state, row, column) of the shortest exposure, dark level taken off, as parts of full scale."""
    store = FrameStore.open(ROOT / "captures/gold/lights" / LIGHT / "frames.zarr")
    frames = store.read_band(int(BAND.removesuffix("nm")), slice(None), slice(None))[:, 0].astype(np.float64)
    dark = store.mean_dark(slice(None), slice(None))[0]
    return np.maximum(frames - dark, 0.0) / store.header.saturation


def photographs(axes: list[Axes], frames: Float) -> None:
    """The gold sphere at three states of the retarders."""
    for panel, state in zip(axes, (0, 4, 12), strict=True):
        panel.imshow(np.cbrt(frames[state]), cmap="gray", vmin=0.0, vmax=np.cbrt(frames.max()))
        panel.set_title(f"retarders {5 * 5 * state % 360}°, {5 * state}°", fontsize=8)


def elements(axes: list[Axes], matrices: Float, signed: Scale) -> None:
    """The telling elements of matrices (rows, columns, 4, 4), divided by M00."""
    first = matrices[..., 0, 0]
    for panel, (i, j) in zip(axes, ELEMENTS, strict=True):
        if (i, j) == (0, 0):
            picture = np.where(first > 0, first, np.nan)
            panel.imshow(
                np.log(picture), cmap="cividis", vmin=np.log(np.nanmax(picture) / 300), aspect="auto"
            )
        else:
            shown = np.where(first > 0, matrices[..., i, j] / first, np.nan)
            panel.imshow(signed.paint(shown, np.isfinite(shown)), aspect="auto", interpolation="none")
        panel.set_title(f"M{i}{j}" + ("" if i == j == 0 else "/M00"), fontsize=8)


def main() -> None:
    """Draw the picture."""
    matplotlib.rcParams["font.family"] = "DejaVu Sans"
    figure = Figure(figsize=(11.0, 6.3), dpi=110, layout="constrained")
    FigureCanvasAgg(figure)
    grid = figure.subfigures(2, 2, width_ratios=(1, 1), height_ratios=(1, 1))
    blocks = [part.subplots(2, 3) for part in grid.flat]
    for axes in blocks:
        for panel in axes.flat:
            panel.set_xticks([])
            panel.set_yticks([])
    titles = (
        f"Photographs, {BAND[:3]} nm, arm at {float(LIGHT):g}°; pixels over the 36 states",
        "Mueller image, in the frames of generator and analyser",
        f"Table over θh (right) and φd (up) at θd = {THETA_D:g}°",
        "Baek 2018 fitted to it: a real index has no M23",
    )
    for part, title in zip(grid.flat, titles, strict=True):
        part.suptitle(title, fontsize=10, fontweight="bold")
    signed = signed_gamma("Mij/M00")

    frames = short_exposures()
    photographs(list(blocks[0][0]), frames)
    for panel, (row, column) in zip(blocks[0][1], ((96, 96), (60, 96), (96, 130)), strict=True):
        panel.plot(5 * np.arange(len(frames)), frames[:, row, column], ".-", ms=4, lw=0.8, color="#0072B2")
        panel.set_title(f"pixel ({row}, {column})", fontsize=8)
        panel.set_ylim(0, None)

    mueller = read_mueller_exr(ROOT / "results/gold/mueller" / LIGHT / f"{BAND}.exr").mueller
    image = np.moveaxis(mueller.reshape(4, 4, *mueller.shape[1:]), (0, 1), (-2, -1))
    image = np.where(image[..., :1, :1] > 0.005 * np.nanmax(image[..., 0, 0]), image, np.nan)
    elements(list(blocks[1].flat), image, signed)

    table = read_table(ROOT / "results/gold/table.zarr")
    band = int(np.abs(table.wavelengths_nm - float(BAND[:3])).argmin())
    node = int(np.abs(np.degrees(table.theta_d) - THETA_D).argmin())
    measured = np.swapaxes(table.mueller[band, :, node], 0, 1)[::-1]
    elements(list(blocks[2].flat), measured, signed)
    theta_h, phi_d = np.meshgrid(table.theta_h, table.phi_d[::-1])
    fit = read_fit(ROOT / "results/gold/fit/baek2018.json")
    model = model_at(fit, band, theta_h, np.full_like(theta_h, table.theta_d[node]), phi_d)
    elements(list(blocks[3].flat), np.where(np.isfinite(measured), model, np.nan), signed)

    figure.savefig(ROOT / "reports/picture.png", metadata={"Software": None})


if __name__ == "__main__":
    main()
