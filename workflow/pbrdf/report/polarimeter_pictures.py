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
    """Draw signals and prediction of each reference in one band, and residuals in units of noise below."""
    band = signals.bands_nm.index(band_nm)
    order = np.arange(1, signals.signal.shape[-1] + 1)
    first = ~signals.repeats
    pulls = (signals.signal - signals.predicted) / signals.noise

    def draw(figure: Figure) -> None:
        panels = figure.subplots(
            2, len(signals.names), sharex=True, sharey="row", squeeze=False, height_ratios=(2, 1)
        )
        figure.subplots_adjust(0.07, 0.12, 0.99, 0.88, hspace=0.1, wspace=0.05)
        for column, name in enumerate(signals.names):
            above, below = panels[:, column]
            seen, fitted = signals.signal[column, band] / 1e6, signals.predicted[column, band] / 1e6
            above.plot(order, fitted, lw=1.0, color=FITTED_COLOUR, label="predicted")
            above.plot(order[first], seen[first], "o", ms=3.5, mew=0, color=FOUND_COLOUR, label="found")
            above.plot(
                order[~first],
                seen[~first],
                "o",
                ms=4,
                mew=0.9,
                mfc="none",
                color=FOUND_COLOUR,
                label="repeat",
            )
            above.set_title(name, loc="left")
            below.axhline(0.0, lw=1.0, color=FITTED_COLOUR)
            below.plot(order[first], pulls[column, band][first], "o", ms=3, mew=0, color=FOUND_COLOUR)
            below.plot(
                order[~first],
                pulls[column, band][~first],
                "o",
                ms=3.5,
                mew=0.9,
                mfc="none",
                color=FOUND_COLOUR,
            )
            below.set_xlabel("photograph")
            for axes in (above, below):
                axes.grid(True)
        panels[0, 0].set_ylabel("signal, 10⁶ DN/s")
        panels[1, 0].set_ylabel("residual, noise")
        figure.legend(*panels[0, 0].get_legend_handles_labels(), loc="upper right", ncols=3, frameon=False)

    rms = ", ".join(
        f"{name} {written(float(np.sqrt(np.mean(pulls[index, band] ** 2))))}"
        for index, name in enumerate(signals.names)
    )
    return picture(
        (12.2, 4.6), draw, f"Signals at {band_nm} nm beside their fit; rms residual over noise: {rms}."
    )
