"""A polarimeter's retardances by band, and the signals of its references beside their fit."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from pbrdf.formats.documents import member, number
from pbrdf.report.figures import Picture, picture
from pbrdf.report.figures import number as written
from pbrdf.report.polarimeter_signals import ReferenceSignals

FOUND_COLOUR, FITTED_COLOUR, IDEAL_COLOUR = "#0072B2", "#D55E00", "#555555"
HOLLOW: dict[str, Any] = {"mew": 0.9, "mfc": "none", "color": FOUND_COLOUR}
MODULES = (("generator", "#0072B2", "o"), ("analyser", "#D55E00", "s"))
LEAST_WAVES = 0.01
"""Half of the range of retardances that is shown at least: what makers promise of achromatic retarders."""


def retardance_picture(document: str | Path, content: Mapping[str, Any]) -> Picture:
    """Draw both retardances over the bands, in waves, beside the ideal quarter wave."""
    curve = member(document, content, "retardance_curve")
    bands = np.array(curve["wavelengths_nm"], dtype=np.float64)
    ideal = number(document, content, "retardance_curve.ideal_waves")
    values = {
        module: tuple(
            np.array(curve[f"{module}_{what}_waves"], dtype=np.float64)
            for what in ("retardance", "standard_error")
        )
        for module, _, _ in MODULES
    }
    span = max(float(np.abs(waves - ideal).max()) for waves, _ in values.values())

    def draw(figure: Figure) -> None:
        axes = figure.subplots()
        figure.subplots_adjust(0.09, 0.13, 0.985, 0.96)
        axes.axhline(ideal, color=IDEAL_COLOUR, lw=1.0, ls="--", label="ideal quarter wave")
        for module, colour, mark in MODULES:
            waves, errors = values[module]
            axes.errorbar(
                bands, waves, yerr=errors, fmt=f"{mark}-", ms=5, lw=1.0, capsize=3, color=colour, label=module
            )
        limit = max(1.15 * span, LEAST_WAVES)
        axes.set_ylim(ideal - limit, ideal + limit)
        axes.set_xlabel("wavelength, nm")
        axes.set_ylabel("retardance, waves")
        axes.grid(True)
        axes.legend(loc="lower center", ncols=3, frameon=False)

    words = "; ".join(
        f"{module} {', '.join(f'{written(float(w), 4)} at {nm:g} nm' for nm, w in pairs)}"
        for module, pairs in ((m, zip(bands, waves, strict=True)) for m, (waves, _) in values.items())
    )
    return picture((9.4, 4.2), draw, f"Retardance by band, waves, beside {written(ideal)}: {words}.")


def signal_picture(signals: ReferenceSignals, band_nm: int) -> Picture:
    """Draw signals and prediction of each reference in one band."""
    band = signals.bands_nm.index(band_nm)
    order = np.arange(1, signals.signal.shape[-1] + 1)
    first = ~signals.repeats

    def draw(figure: Figure) -> None:
        panels = figure.subplots(1, len(signals.names), sharex=True, sharey=True, squeeze=False)[0]
        figure.subplots_adjust(0.07, 0.16, 0.99, 0.85, wspace=0.05)
        for axes, name, seen, fitted in zip(
            panels, signals.names, signals.signal[:, band], signals.predicted[:, band], strict=True
        ):
            axes.plot(order, fitted / 1e6, lw=1.0, color=FITTED_COLOUR, label="predicted")
            axes.plot(order[first], seen[first] / 1e6, "o", ms=3.5, mew=0, color=FOUND_COLOUR, label="found")
            axes.plot(order[~first], seen[~first] / 1e6, "o", ms=4, label="repeat", **HOLLOW)
            axes.set_title(name, loc="left")
            axes.set_xlabel("photograph")
            axes.grid(True)
        panels[0].set_ylabel("signal, 10⁶ DN/s")
        handles = panels[0].get_legend_handles_labels()
        figure.legend(*handles, loc="upper right", ncols=3, frameon=False)

    alt = f"Signals of {', '.join(signals.names)} at {band_nm} nm, state by state, beside what is predicted."
    return picture((12.2, 3.0), draw, alt)


def residual_picture(signals: ReferenceSignals) -> Picture:
    """Draw found less predicted in units of noise: a row a band, a column a reference."""
    order = np.arange(1, signals.signal.shape[-1] + 1)
    first = ~signals.repeats
    pulls = signals.pulls
    limit = 1.1 * float(np.abs(pulls).max())
    rows = len(signals.bands_nm)
    height = 1.0 * rows + 0.7

    def draw(figure: Figure) -> None:
        panels = figure.subplots(rows, len(signals.names), sharex=True, sharey=True, squeeze=False)
        figure.subplots_adjust(0.07, 0.45 / height, 0.99, 1 - 0.25 / height, hspace=0.1, wspace=0.05)
        for row, of_band in zip(panels, np.moveaxis(pulls, 1, 0), strict=True):
            for axes, values in zip(row, of_band, strict=True):
                axes.axhline(0.0, lw=1.0, color=FITTED_COLOUR)
                axes.plot(order[first], values[first], "o", ms=3, mew=0, color=FOUND_COLOUR)
                axes.plot(order[~first], values[~first], "o", ms=3.5, **HOLLOW)
                axes.set_ylim(-limit, limit)
                axes.grid(True)
        for axes, name in zip(panels[0], signals.names, strict=True):
            axes.set_title(name, loc="left")
        for axes in panels[-1]:
            axes.set_xlabel("photograph")
        for axes, nm in zip(panels[:, 0], signals.bands_nm, strict=True):
            axes.set_ylabel(f"{nm} nm")
        figure.supylabel("(found − predicted) / noise, no unit", x=0.008, fontsize=8)

    rms = "; ".join(
        f"{nm} nm {', '.join(written(float(r)) for r in np.sqrt(np.mean(pulls[:, band] ** 2, axis=-1)))}"
        for band, nm in enumerate(signals.bands_nm)
    )
    alt = f"Residuals over noise of {', '.join(signals.names)} by band; rms: {rms}."
    return picture((12.2, height), draw, alt)
