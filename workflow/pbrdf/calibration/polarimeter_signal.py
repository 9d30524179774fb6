"""What a polarimeter's detector sees of known references, and how that changes with each parameter.

The parameters of a fit stand in one vector: zeros of the elements, shared by all bands; for each
band the two retardances; for each reference and band an amplitude; then, where asked for, for each
band the extinction of the polarisers, and for each reference and band the lamp's drift. That is a
straight line, or a cubic spline whose parameters are its values where one state was repeated.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from pbrdf.calibration.polarimeter import ELEMENTS
from pbrdf.errors import InputError

Float = NDArray[np.float64]

Amplitude = Literal["free", "maximum"]

Drift = bool | tuple[int, ...]
"""Whether the lamp drifts; if not in a straight line, places in the run where its power is a parameter."""

_TURNED_OVER = np.array([1.0, 1.0, 1.0, -1.0])


@dataclass(frozen=True)
class Reference:
    """A thing of known polarisation in the beam.

    Attributes
    ----------
    name : str
        As messages and documents call it.
    mueller : ndarray, shape (4, 4)
        From the generator's frame to the analyser's, up to a factor.
    """

    name: str
    mueller: Float


def polarised_light(
    polariser: Float, retarder: Float, retardance: Float, extinction: Float
) -> tuple[Float, Float]:
    """Stokes vectors behind a polariser and a retarder, and their derivatives.

    Written out from the product of the two matrices (Chenault et al. 1992 for a polariser along x);
    the first row of an analyser is the same vector with s3 turned over.

    Parameters
    ----------
    polariser, retarder : ndarray, shape (N,)
        Angles of the axes, radians.
    retardance, extinction : ndarray, shape (B,)
        Of each band, radians and 1.

    Returns
    -------
    vectors : ndarray, shape (B, N, 4)
    derivatives : ndarray, shape (4, B, N, 4)
        With respect to polariser, retarder, retardance and extinction.
    """
    delta = retardance[:, None]
    leak = extinction[:, None]
    kept, turned = np.cos(delta / 2) ** 2, np.sin(delta / 2) ** 2
    c, s = np.cos(2 * polariser), np.sin(2 * polariser)
    c4, s4 = np.cos(4 * retarder - 2 * polariser), np.sin(4 * retarder - 2 * polariser)
    c2, s2 = np.cos(2 * retarder - 2 * polariser), np.sin(2 * retarder - 2 * polariser)
    sine, cosine = np.sin(delta), np.cos(delta)
    zero = np.zeros(np.broadcast_shapes(delta.shape, polariser.shape))
    polarised = _stokes(zero, kept * c + turned * c4, kept * s + turned * s4, sine * s2)
    by_angle = [
        _stokes(zero, 2 * (turned * s4 - kept * s), 2 * (kept * c - turned * c4), -2 * sine * c2),
        _stokes(zero, -4 * turned * s4, 4 * turned * c4, 2 * sine * c2),
        _stokes(zero, 0.5 * sine * (c4 - c), 0.5 * sine * (s4 - s), cosine * s2),
    ]
    bright = _stokes(zero + 1.0, zero, zero, zero)
    contrast = (1.0 - leak)[..., None]
    vectors = 0.5 * ((1.0 + leak)[..., None] * bright + contrast * polarised)
    derivatives = [0.5 * contrast * derivative for derivative in by_angle]
    return vectors, np.stack([*derivatives, 0.5 * (bright - polarised)])


@dataclass(frozen=True)
class Elements:
    """Values of all parameters, by what they are of.

    Attributes
    ----------
    zeros : ndarray, shape (4,)
        Of the axes, in the order of `ELEMENTS`, radians.
    generator_retardances, analyser_retardances, extinctions : ndarray, shape (B,)
    amplitudes : ndarray, shape (R, B)
        b in ``signal = b W vec(M)``.
    drifts : ndarray, shape (R, B, K)
        Coefficients of `lamp_functions`.
    """

    zeros: Float
    generator_retardances: Float
    analyser_retardances: Float
    extinctions: Float
    amplitudes: Float
    drifts: Float


class SignalModel:
    """Signals of references in all bands as a function of the parameters.

    Parameters
    ----------
    states : ndarray, shape (N, 4)
        Scale readings, radians, in the order in which they were taken.
    references : sequence of Reference, length R
    bands : int
        Number B of bands.
    free_frame : bool
        The generator polariser's zero is a parameter too, otherwise it stays at `frame`.
    frame : float
        That zero, radians.
    extinction : bool
        Whether it is a parameter; otherwise 0.
    drift : bool or tuple of int
        As `lamp_functions` takes it.
    peaks : ndarray, shape (R, B), optional
        Largest signals: if given, predictions are scaled to these and amplitudes are no parameters.
    """

    def __init__(
        self,
        states: Float,
        references: Sequence[Reference],
        bands: int,
        *,
        free_frame: bool,
        frame: float,
        extinction: bool,
        drift: Drift,
        peaks: Float | None = None,
    ) -> None:
        self.states = states
        self.references = tuple(references)
        self.bands = bands
        self.free_frame = free_frame
        self.frame = frame
        self.extinction = extinction
        self.drift = drift
        self.peaks = peaks
        self._matrices = np.stack([np.asarray(r.mueller, dtype=np.float64) for r in references])
        self._lamp_functions = lamp_functions(drift, len(states))
        cells = len(references) * bands
        sizes = {
            "zeros": 3 + free_frame,
            "generator": bands,
            "analyser": bands,
            "amplitudes": 0 if peaks is not None else cells,
            "extinctions": bands if extinction else 0,
            "drifts": cells * self.lamp_freedom,
        }
        ends = np.cumsum([0, *sizes.values()])
        self.parts = {
            name: slice(int(first), int(last))
            for name, first, last in zip(sizes, ends[:-1], ends[1:], strict=True)
        }
        self.size = int(ends[-1])

    @property
    def lamp_freedom(self) -> int:
        """Number K of parameters of the lamp's drift, of each reference in each band."""
        return int(self._lamp_functions.shape[1])

    def pack(self, elements: Elements) -> Float:
        """Parameter vector of these values."""
        return np.concatenate(
            [
                elements.zeros[0 if self.free_frame else 1 :],
                elements.generator_retardances,
                elements.analyser_retardances,
                elements.amplitudes.ravel() if self.peaks is None else [],
                elements.extinctions if self.extinction else [],
                elements.drifts.ravel(),
            ]
        )

    def unpack(self, vector: Float) -> Elements:
        """Values in a parameter vector, with those that are no parameters."""
        elements = self.split(vector, frame=self.frame, amplitude=1.0)
        if self.peaks is None:
            return elements
        return replace(elements, amplitudes=self.peaks / self.signal(elements).max(axis=-1))

    def split(self, vector: Float, *, frame: float, amplitude: float) -> Elements:
        """Entries of a vector by what they are of; what is no parameter is `frame`, `amplitude` or 0."""
        part = {name: vector[where] for name, where in self.parts.items()}
        shape = (len(self.references), self.bands)
        return Elements(
            zeros=part["zeros"] if self.free_frame else np.concatenate([[frame], part["zeros"]]),
            generator_retardances=part["generator"],
            analyser_retardances=part["analyser"],
            extinctions=part["extinctions"] if self.extinction else np.zeros(self.bands),
            amplitudes=(
                part["amplitudes"].reshape(shape) if self.peaks is None else np.full(shape, amplitude)
            ),
            drifts=part["drifts"].reshape(*shape, self.lamp_freedom),
        )

    def of_parameters(self, name: str) -> list[str]:
        """What the parameters of one part are called, for messages."""
        if name == "zeros":
            return [f"zero of the {e.replace('_', ' ')}" for e in ELEMENTS[0 if self.free_frame else 1 :]]
        what = {
            "generator": "generator's retardance",
            "analyser": "analyser's retardance",
            "amplitudes": "amplitude",
            "extinctions": "extinction",
            "drifts": "lamp drift",
        }[name]
        where = self.parts[name]
        return [what] * (where.stop - where.start)

    def signal(self, elements: Elements) -> Float:
        """Predicted signals, shape (R, B, N)."""
        (g, _), (a, _) = self._vectors(elements)
        return self._lamp(elements) * self._through(a, g)

    def jacobian(self, elements: Elements) -> Float:
        """Derivatives of the signals with respect to the parameter vector, shape (R, B, N, parameters)."""
        (g, dg), (a, da) = self._vectors(elements)
        lamp = self._lamp(elements)
        through = self._through(a, g)
        by_generator = np.stack([lamp * self._through(a, d) for d in dg])
        by_analyser = np.stack([lamp * self._through(d, g) for d in da])
        jacobian = np.zeros((*through.shape, self.size))
        zeros = np.stack([by_generator[0], by_generator[1], by_analyser[1], by_analyser[0]], axis=-1)
        jacobian[..., self.parts["zeros"]] = zeros[..., 0 if self.free_frame else 1 :]
        bands = np.arange(self.bands)
        every = slice(None)

        def fill(part: str, derivative: Float) -> None:
            jacobian[every, bands, every, self.parts[part].start + bands] = np.moveaxis(derivative, 1, 0)

        fill("generator", by_generator[2])
        fill("analyser", by_analyser[2])
        if self.extinction:
            fill("extinctions", by_generator[3] + by_analyser[3])
        if self.peaks is None:
            self._fill_cells(jacobian, "amplitudes", (through * self.lamp_power(elements))[..., None])
        steady = through * elements.amplitudes[..., None]
        self._fill_cells(jacobian, "drifts", steady[..., None] * self._lamp_functions)
        return jacobian if self.peaks is None else self._scaled_to_peak(lamp * through, jacobian)

    def lamp_power(self, elements: Elements) -> Float:
        """Power of the lamp over the run, shape (R, B, N), relative to what `lamp_functions` holds at one."""
        power: Float = 1.0 + elements.drifts @ self._lamp_functions.T
        return power

    def _vectors(self, elements: Elements) -> tuple[tuple[Float, Float], tuple[Float, Float]]:
        """Generated and analysed Stokes vectors with their derivatives."""
        axes = (self.states + elements.zeros).T
        generated = polarised_light(axes[0], axes[1], elements.generator_retardances, elements.extinctions)
        a, da = polarised_light(axes[3], axes[2], elements.analyser_retardances, elements.extinctions)
        return generated, (a * _TURNED_OVER, da * _TURNED_OVER)

    def _through(self, a: Float, g: Float) -> Float:
        """Products a · M g for all references, shape (R, B, N)."""
        result: Float = np.einsum("rbni,bni->rbn", a @ self._matrices[:, None], g)
        return result

    def _lamp(self, elements: Elements) -> Float:
        return elements.amplitudes[..., None] * self.lamp_power(elements)

    def _fill_cells(self, jacobian: Float, part: str, derivatives: Float) -> None:
        """Put in derivatives (R, B, N, K) with respect to K parameters of one reference in one band."""
        first, count = self.parts[part].start, derivatives.shape[-1]
        for reference, band in np.ndindex(*derivatives.shape[:2]):
            at = first + (reference * self.bands + band) * count
            jacobian[reference, band, :, at : at + count] = derivatives[reference, band]

    def _scaled_to_peak(self, signal: Float, jacobian: Float) -> Float:
        """Derivatives of a prediction that is kept at its peak, from those of the one that is not."""
        at = signal.argmax(axis=-1)[..., None]
        peak = np.take_along_axis(signal, at, axis=-1)
        at_peak = np.take_along_axis(jacobian, at[..., None], axis=-2)
        scaled: Float = jacobian - (signal / peak)[..., None] * at_peak
        return scaled


def lamp_functions(drift: Drift, count: int) -> Float:
    """How the lamp's power changes over a run with each parameter of its drift.

    Parameters
    ----------
    drift : bool or tuple of int
        Places in the run, ascending: the power follows the cubic spline through its values there (a line
        through two, a parabola through three), stays before and after, and is one at the first. True: a
        straight line that is one in the middle. False: none.
    count : int
        States of the run.

    Returns
    -------
    ndarray, shape (count, K)
        Per relative change of the power at each place but the first, or from the first state to the last.
    """
    if isinstance(drift, bool):
        return np.linspace(-0.5, 0.5, count)[:, None][:, : int(drift)]
    places = np.clip(np.arange(count), drift[0], drift[-1])
    functions: Float = CubicSpline(drift, np.eye(len(drift)))(places)[:, 1:]
    return functions


def checked_references(references: Sequence[Reference], source: str) -> None:
    """Raise `InputError` unless every reference is a finite matrix that passes light."""
    if not references:
        raise InputError(source, "references", "are none", "name at least one, e.g. air")
    for reference in references:
        matrix = np.asarray(reference.mueller, dtype=np.float64)
        if matrix.shape != (4, 4) or not np.isfinite(matrix).all() or matrix[0, 0] <= 0:
            raise InputError(
                source, f"references.{reference.name}", "is not a Mueller matrix", "give 4×4 finite numbers"
            )


def _stokes(s0: Float, s1: Float, s2: Float, s3: Float) -> Float:
    return np.stack(np.broadcast_arrays(s0, s1, s2, s3), axis=-1)
