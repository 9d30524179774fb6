"""A radiometry's page: noise against signal, linearity, and the lamp's power by band."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pbrdf.calibration.radiometry import KIND
from pbrdf.formats.documents import member, number, read_document, wavelengths
from pbrdf.report.calibration_parts import (
    VALUE_HEAD,
    CalibrationView,
    Cell,
    Grid,
    Number,
    Section,
    value_row,
    with_error,
)
from pbrdf.report.figures import Float, Picture, picture
from pbrdf.report.figures import number as written
from pbrdf.report.flat_view import BAND_COLOURS

LINE_COLOUR, DARK_COLOUR = "#555555", "#999999"
LIGHT_COLOURS = ("#E69F00", "#009E73", "#D55E00", "#CC79A7", "#56B4E9", "#000000")


def radiometry_view(document: str | Path) -> CalibrationView:
    """Content of a measured radiometry's page; raises `InputError` if the document cannot be used."""
    content = read_document(document, KIND)
    bands = list(wavelengths(document, content, "scale"))
    reflectance = number(document, content, "reflectance")
    return CalibrationView(
        values=[_values(document, content), _scales(document, content)],
        sections=[
            Section(
                "Noise against signal",
                [_transfer(document, content, bands)],
                "Variance of a pixel over repeats of the same photograph, against its mean above the dark "
                "level; each point is the mean over the frame's pixels. The slope is the gain, the variance "
                "without signal that of reading. Below: distance from the line, with standard errors.",
            ),
            Section(
                "Linearity",
                [_linearity(document, content)],
                "Signal beside what the pixel's own rate and the exposure time make expected, by raw level, "
                "with standard errors; all bands together. Beyond the tolerance values are not used.",
            ),
            Section(
                "The lamp's power",
                [_powers(document, content)],
                f"From the Spectralon tile of reflectance {written(reflectance, 4)}: above, the mean over "
                "the arm's angles; below, what each angle says. Error bars are of one standard error "
                "and may be smaller than the marks. The same angle off in every band would be a tile that "
                "is not diffuse, or geometry that is wrong; a scatter without order is the lamp's.",
            ),
            Section("Dark frames", (), "", [_dark(document, content)]),
        ],
    )


def _values(document: str | Path, content: Mapping[str, Any]) -> Grid:
    rows = [
        value_row(
            "gain (one electron)",
            number(document, content, "dn_per_electron"),
            number(document, content, "dn_per_electron_standard_error"),
            "DN",
        ),
        value_row(
            "read noise",
            number(document, content, "read_noise_dn"),
            number(document, content, "read_noise_standard_error_dn"),
            "DN",
        ),
        value_row(
            "χ² of the noise's line, over the degrees of freedom",
            number(document, content, "chi_square_per_freedom"),
            None,
            "1",
        ),
        value_row(
            "largest deviation from linearity",
            number(document, content, "linearity.largest_deviation"),
            None,
            "1",
        ),
        value_row(
            "linearity is known up to", number(document, content, "linearity.tested_to_dn"), None, "DN", 5
        ),
        value_row("reflectance of the tile (given)", number(document, content, "reflectance"), None, "1"),
    ]
    if "saturation_dn" in content:
        rows.append(value_row("linear below", number(document, content, "saturation_dn"), None, "DN", 5))
    return Grid("Of the camera; DN are steps as stored.", VALUE_HEAD, rows)


def _scales(document: str | Path, content: Mapping[str, Any]) -> Grid:
    rows: list[list[Cell]] = []
    for name in wavelengths(document, content, "scale").values():

        def at(field: str, band: str = name) -> float:
            return number(document, content, f"{field}.{band}")

        rows.append(
            [
                f"{name} nm",
                *with_error(at("scale"), at("scale_standard_error")),
                *(
                    Number(v, 2)
                    for v in (at("unevenness"), at("unevenness_standard_error"), at("lamp_range"))
                ),
                Number(round(at("pixels"))),
            ]
        )
    return Grid(
        f"Scale: {member(document, content, 'scale_unit')}. Unevenness is that of the part of the tile "
        "that is farthest from the mean; the lamp's change is largest less smallest while the tile was "
        "photographed.",
        ("band", "scale", "standard error", "unevenness", "its error", "lamp's change, relative", "pixels"),
        rows,
    )


def _dark(document: str | Path, content: Mapping[str, Any]) -> Grid:
    return Grid(
        "Level and noise without light",
        ("exposure, ms", "level, DN", "noise, DN"),
        [
            [written(1000 * each["exposure_s"]), Number(each["level_dn"], 6), Number(each["noise_dn"], 4)]
            for each in member(document, content, "dark")
        ],
    )


def _transfer(document: str | Path, content: Mapping[str, Any], bands: list[int]) -> Picture:
    points = member(document, content, "photon_transfer")
    gain = number(document, content, "dn_per_electron")
    signal, variance, residual, error = (
        np.array([point[name] for point in points], dtype=np.float64)
        for name in ("signal_dn", "variance_dn2", "relative_residual", "relative_standard_error")
    )
    # the line's own value without signal; the document's read noise is not below a converter's step
    at_dark = float(np.median(variance / (1 + residual) - gain * signal))
    of_band = [point["band_nm"] for point in points]

    def draw(figure: Figure) -> None:
        above, below = figure.subplots(2, 1, sharex=True, height_ratios=(2.2, 1))
        figure.subplots_adjust(0.09, 0.1, 0.985, 0.97, hspace=0.08)
        across = np.linspace(0.0, 1.03 * float(signal.max()), 2)
        above.plot(across, at_dark + gain * across, lw=1.0, color=LINE_COLOUR, label="line")
        below.axhline(0.0, lw=1.0, color=LINE_COLOUR)
        for band, (name, colour, style) in _series(bands).items():
            chosen = np.array([each == band for each in of_band])
            if not chosen.any():
                continue
            above.plot(signal[chosen], variance[chosen], style, ms=4.5, mew=0, color=colour, label=name)
            below.errorbar(
                signal[chosen],
                100 * residual[chosen],
                yerr=100 * error[chosen],
                fmt=style,
                ms=4,
                mew=0,
                lw=0.8,
                color=colour,
            )
        above.set_ylabel("variance, DN²")
        above.legend(loc="upper left", frameon=False)
        below.set_ylabel("off the line, %")
        below.set_xlabel("signal above the dark level, DN")
        for axes in (above, below):
            axes.grid(True)

    alt = f"Variance against signal of {len(points)} sets of frames about a line of slope {written(gain, 4)} "
    alt += f"DN; largest distance {written(100 * float(np.abs(residual).max()))} %."
    return picture((9.4, 5.2), draw, alt)


def _series(bands: list[int]) -> dict[int | None, tuple[str, str, str]]:
    """Name, colour and mark of dark frames (None) and bands."""
    series: dict[int | None, tuple[str, str, str]] = {None: ("dark", DARK_COLOUR, "s")}
    for index, nm in enumerate(bands):
        series[nm] = (f"{nm} nm", BAND_COLOURS[index % len(BAND_COLOURS)], "o")
    return series


def _linearity(document: str | Path, content: Mapping[str, Any]) -> Picture:
    straight = member(document, content, "linearity")
    level, deviation, error = (
        np.array(straight[name], dtype=np.float64)
        for name in ("level_dn", "deviation", "deviation_standard_error")
    )
    tolerance = number(document, content, "linearity.tolerance")
    limit = content.get("saturation_dn")

    def draw(figure: Figure) -> None:
        axes = figure.subplots()
        figure.subplots_adjust(0.09, 0.15, 0.985, 0.95)
        axes.axhline(0.0, lw=1.0, color=LINE_COLOUR)
        for sign in (-1, 1):
            axes.axhline(
                100 * sign * tolerance,
                lw=0.8,
                ls="--",
                color="#D55E00",
                label="tolerance" if sign > 0 else None,
            )
        if limit is not None:
            axes.axvline(float(limit), lw=0.8, color="#D55E00", label="not used from here on")
        axes.errorbar(
            level, 100 * deviation, yerr=100 * error, fmt="o", ms=3.5, mew=0, lw=0.8, color="#0072B2"
        )
        _percent(axes, 100 * deviation, 100 * tolerance)
        axes.set_xlabel("raw level, DN")
        axes.set_ylabel("deviation of the signal, %")
        axes.grid(True)
        axes.legend(loc="upper left", frameon=False)

    largest = number(document, content, "linearity.largest_deviation")
    alt = f"Deviation from linearity by raw level, at most {written(100 * largest)} % where values are used."
    return picture((9.4, 3.4), draw, alt)


def _percent(axes: Axes, values: Float, tolerance: float) -> None:
    """Show at least the tolerance, and not what clips at the end of the range."""
    limit = max(1.5 * tolerance, min(1.1 * float(np.abs(values).max(initial=0.0)), 10 * tolerance))
    axes.set_ylim(-limit, limit)


def _powers(document: str | Path, content: Mapping[str, Any]) -> Picture:
    bands = wavelengths(document, content, "scale")
    scale, error = (
        np.array([number(document, content, f"{field}.{name}") for name in bands.values()])
        for field in ("scale", "scale_standard_error")
    )
    by_light = member(document, content, "scale_by_light")

    shares = {
        light: 100 * (np.array([values[name] for name in bands.values()]) / scale - 1)
        for light, values in by_light.items()
    }

    def draw(figure: Figure) -> None:
        above, below = figure.subplots(2, 1, sharex=True, height_ratios=(1, 1.2))
        figure.subplots_adjust(0.09, 0.11, 0.985, 0.97, hspace=0.1)
        # a line between bands would be a spectrum that nobody measured
        marks: dict[str, Any] = {"fmt": "o", "ms": 4, "mew": 0, "lw": 1.0, "capsize": 3}
        above.errorbar(list(bands), scale / 1e6, yerr=error / 1e6, color="#0072B2", **marks)
        above.set_ylim(0.0, 1.15 * float(scale.max()) / 1e6)
        above.set_ylabel("scale, 10⁶ DN/s")
        below.axhline(0.0, lw=0.6, color=LINE_COLOUR)
        below.errorbar(
            list(bands), 0 * scale, yerr=100 * error / scale, color="#0072B2", label="mean", **marks
        )
        for index, (light, values) in enumerate(shares.items()):
            colour = LIGHT_COLOURS[index % len(LIGHT_COLOURS)]
            below.plot(list(bands), values, "_", ms=12, mew=1.6, color=colour, label=f"arm at {light}°")
        below.margins(y=0.15)
        below.set_xticks(list(bands))
        below.set_xlabel("band, nm")
        below.set_ylabel("off the mean, %")
        below.legend(loc="center left", bbox_to_anchor=(0.005, 0.5), frameon=True)
        for axes in (above, below):
            axes.grid(True)
        step = np.diff(list(bands)).min() if len(bands) > 1 else 50.0
        below.set_xlim(min(bands) - 0.9 * step, max(bands) + 0.4 * step)

    values = ", ".join(f"{nm} nm {written(float(v), 4)}" for nm, v in zip(bands, scale, strict=True))
    largest = max((float(np.abs(each).max()) for each in shares.values()), default=0.0)
    alt = f"Scale by band, DN/s of 1/sr: {values}; by angle of the arm within {written(largest, 2)} %."
    return picture((9.4, 4.4), draw, alt)
