"""Fits of analytic models to tables: nodes, objective, solver, uncertainty, result, comparison."""

from __future__ import annotations

from pbrdf.fitting.driver import fit, fit_table
from pbrdf.fitting.options import FitOptions
from pbrdf.fitting.result import FitResult, FittedParameter, read_fit

__all__ = ["FitOptions", "FitResult", "FittedParameter", "fit", "fit_table", "read_fit"]
