"""Fits of analytic models to tables: the objective, the solver, and the result."""

from __future__ import annotations

from pbrdf.fitting.driver import fit
from pbrdf.fitting.result import FitResult, FittedParameter, read_fit

__all__ = ["FitResult", "FittedParameter", "fit", "read_fit"]
