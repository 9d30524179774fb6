"""What a polarimeter's detector sees of known references, and how that changes with each parameter.

The parameters of a fit stand in one vector: zeros of the elements, shared by all bands; for each
band the two retardances; for each reference and band an amplitude; then, where asked for, for each
band the extinction of the polarisers, and for each reference and band the lamp's drift.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from pbrdf.calibration.polarimeter import ELEMENTS
from pbrdf.errors import InputError

Float = NDArray[np.float64]

Amplitude = Literal["free", "maximum"]

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
    drifts : ndarray, shape (R, B)
        Relative change of the lamp from the first to the last state.
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
    extinction, drift : bool
        Whether these are parameters; otherwise 0.
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
        drift: bool,
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
        self._time = np.linspace(-0.5, 0.5, len(states))
        cells = len(references) * bands
        sizes = {
            "zeros": 3 + free_frame,
            "generator": bands,
            "analyser": bands,
            "amplitudes": 0 if peaks is not None else cells,
            "extinctions": bands if extinction else 0,
            "drifts": cells if drift else 0,
        }
        ends = np.cumsum([0, *sizes.values()])
        self.parts = {
            name: slice(int(first), int(last))
            for name, first, last in zip(sizes, ends[:-1], ends[1:], strict=True)
        }
        self.size = int(ends[-1])

    def pack(self, elements: Elements) -> Float:
        """Parameter vector of these values."""
        return np.concatenate(
            [
                elements.zeros[0 if self.free_frame else 1 :],
                elements.generator_retardances,
                elements.analyser_retardances,
                elements.amplitudes.ravel() if self.peaks is None else [],
                elements.extinctions if self.extinction else [],
                elements.drifts.ravel() if self.drift else [],
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
            drifts=part["drifts"].reshape(shape) if self.drift else np.zeros(shape),
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
            self._fill_cells(jacobian, "amplitudes", through * self._run(elements))
        if self.drift:
            self._fill_cells(jacobian, "drifts", through * elements.amplitudes[..., None] * self._time)
        return jacobian if self.peaks is None else self._scaled_to_peak(lamp * through, jacobian)

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

    def _run(self, elements: Elements) -> Float:
        """Brightness of the lamp over the run relative to its middle, shape (R, B, N)."""
        run: Float = 1.0 + elements.drifts[..., None] * self._time
        return run

    def _lamp(self, elements: Elements) -> Float:
        return elements.amplitudes[..., None] * self._run(elements)

    def _fill_cells(self, jacobian: Float, part: str, derivative: Float) -> None:
        """Put in derivatives with respect to what belongs to one reference in one band."""
        first = self.parts[part].start
        for reference, band in np.ndindex(*derivative.shape[:2]):
            jacobian[reference, band, :, first + reference * self.bands + band] = derivative[reference, band]

    def _scaled_to_peak(self, signal: Float, jacobian: Float) -> Float:
        """Derivatives of a prediction that is kept at its peak, from those of the one that is not."""
        at = signal.argmax(axis=-1)[..., None]
        peak = np.take_along_axis(signal, at, axis=-1)
        at_peak = np.take_along_axis(jacobian, at[..., None], axis=-2)
        scaled: Float = jacobian - (signal / peak)[..., None] * at_peak
        return scaled


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
