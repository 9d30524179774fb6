"""Maps of what a calibrated polarimeter leaves over: by pixel of the lamp's disc, and by photograph."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from pbrdf.calibration.lamp_disc import lamp_pixels
from pbrdf.calibration.lamp_signal import LampSignal
from pbrdf.calibration.polarimeter_result import residual_map
from pbrdf.capture.frames import in_order
from pbrdf.formats.capture_store import FrameStore, band_name
from pbrdf.report.figures import Float, Picture, number, picture
from pbrdf.report.scales import from_zero, round_up, signed

Window = tuple[slice, slice]

DISC_INCHES, LEFT, ABOVE, BELOW, GAP = 1.35, 0.7, 0.3, 0.55, 0.08
ROW_INCHES, STATES_LEFT, STATES_WIDTH, STATES_BELOW = 0.17, 1.1, 9.4, 0.95
LEAST_TOP = 2.0
"""Of the scale of pixels: noise alone gives one."""


def disc_residuals(store: FrameStore, band_nm: int, found: LampSignal, predicted: Float) -> Float:
    """Residual of each pixel of the lamp's disc over its noise, one brightness a pixel being free.

    Parameters
    ----------
    store : FrameStore
        Photographs of the lamp through a reference.
    band_nm : int
    found : LampSignal
        What `pbrdf.calibration.lamp_signal.lamp_signal` tells of them.
    predicted : ndarray, shape (N,)
        Signals that the calibrated polarimeter predicts, in the order they were taken, in any unit.

    Returns
    -------
    ndarray, shape (rows, columns)
        Root mean square over the N photographs, about one for noise alone, in the rectangle about the
        disc; NaN beside the disc and where a photograph saturates.

    Raises
    ------
    InputError
        If a frame cannot be read, or the lamp is not there.
    """
    header = store.header
    exposure = header.exposures_s.index(found.exposure_s)
    # of a pixel, DN: that of a mean over the disc grows by the root of their number
    noise = found.noise * found.exposure_s * np.sqrt(found.pixels)
    whole = (slice(0, header.rows), slice(0, header.columns))
    mean = np.zeros((header.rows, header.columns))
    for frame in _frames(store, band_nm, whole, exposure):
        mean += frame / len(noise)
    variance = np.full(mean.shape, (noise**2).mean() / len(noise))
    disc = lamp_pixels(mean, variance, store.path, band_name(band_nm))
    rows, columns = (
        slice(int(n[0]), int(n[-1]) + 1) for n in map(np.flatnonzero, (disc.any(1), disc.any(0)))
    )
    stack = np.stack([frame.ravel() for frame in _frames(store, band_nm, (rows, columns), exposure)])
    _, rms = residual_map((predicted / noise)[:, None], stack / noise[:, None], str(store.path))
    # the pixel's own brightness takes one of its degrees of freedom
    rms *= np.sqrt(len(noise) / (len(noise) - 1))
    part = disc[rows, columns]
    return np.where(part, rms.reshape(part.shape), np.nan)


def disc_picture(names: Sequence[str], bands_nm: Sequence[int], maps: Sequence[Sequence[Float]]) -> Picture:
    """Draw the maps of references (outer) in bands (inner): a row a reference, a column a band."""
    known = np.concatenate([each[np.isfinite(each)] for of_band in maps for each in of_band])
    scale = from_zero(
        round_up(max(LEAST_TOP, float(known.max(initial=0.0)))),
        "residual rms of a pixel over its noise, no unit",
    )
    width = LEFT + len(bands_nm) * (DISC_INCHES + GAP)
    height = ABOVE + len(names) * (DISC_INCHES + GAP) + BELOW

    def draw(figure: Figure) -> None:
        for row, (name, of_band) in enumerate(zip(names, maps, strict=True)):
            bottom = height - ABOVE - (row + 1) * DISC_INCHES - row * GAP
            figure.text(
                0.9 * LEFT / width, (bottom + DISC_INCHES / 2) / height, name, ha="right", va="center"
            )
            for column, each in enumerate(of_band):
                left = LEFT + column * (DISC_INCHES + GAP)
                place = (left / width, bottom / height, DISC_INCHES / width, DISC_INCHES / height)
                axes = figure.add_axes(place)
                axes.imshow(scale.paint(each, np.isfinite(each)), interpolation="none")
                axes.set_axis_off()
                if row == 0:
                    axes.set_title(f"{bands_nm[column]} nm", pad=4)
        scale.draw_bar(figure, 0.3, 0.38 / height, 0.4, 0.1 / height)

    words = "; ".join(
        f"{name} {', '.join(number(float(np.nanmedian(each)), 2) for each in of_band)}"
        for name, of_band in zip(names, maps, strict=True)
    )
    bands = ", ".join(map(str, bands_nm))
    return picture(
        (width, height), draw, f"Residuals over noise on the lamp's disc at {bands} nm; medians: {words}."
    )


def state_picture(names: Sequence[str], bands_nm: Sequence[int], pulls: Float) -> Picture:
    """Draw residuals over noise (references, bands, photographs): a row a reference and band."""
    references, bands, photographs = pulls.shape
    rows = references * bands
    largest = float(np.abs(pulls).max())
    scale = signed(float(np.ceil(largest)), "(found − predicted) / noise of the disc's mean, no unit")
    height = ABOVE + rows * ROW_INCHES + STATES_BELOW

    def draw(figure: Figure) -> None:
        axes = figure.add_axes(
            (STATES_LEFT / STATES_WIDTH, STATES_BELOW / height, 0.87, rows * ROW_INCHES / height)
        )
        flat = pulls.reshape(rows, photographs)
        axes.imshow(
            scale.paint(flat, np.isfinite(flat)),
            extent=(0.5, photographs + 0.5, rows - 0.5, -0.5),
            aspect="auto",
            interpolation="none",
        )
        labels = [f"{name}, {nm} nm" for name in names for nm in bands_nm]
        axes.set_yticks(range(rows), labels)
        for line in range(bands, rows, bands):
            axes.axhline(line - 0.5, color="black", lw=0.8)
        axes.set_xlabel("photograph, in the order taken")
        scale.draw_bar(figure, 0.3, 0.38 / height, 0.4, 0.1 / height)

    alt = f"Residuals over noise of {photographs} photographs of {', '.join(names)} in {bands} bands; "
    return picture((STATES_WIDTH, height), draw, f"{alt}the largest is {number(largest)}.")


def _frames(store: FrameStore, band_nm: int, window: Window, exposure: int) -> Iterator[NDArray[Any]]:
    """Frames of states and repeats in the order taken, DN above the dark level; NaN where saturated."""
    dark = store.mean_dark(*window)[exposure]
    states = (frames for (frames,) in store.read_states(band_nm, *window))
    repeats = store.read_references(band_nm, *window)
    for _, repeat in in_order(store.header):
        raw = next(repeats if repeat else states)[exposure]
        yield np.where(raw >= store.header.saturation, np.nan, raw.astype(np.float64) - dark)
