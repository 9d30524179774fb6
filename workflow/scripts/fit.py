"""Fit a model to a table."""

from job import job

from pbrdf.fitting.material import fit_material
from pbrdf.fitting.options import FitOptions

with job(snakemake.log[0]):
    fit_material(
        snakemake.input.table,
        snakemake.input.receipt,
        snakemake.wildcards.model,
        snakemake.output[0],
        FitOptions.of(snakemake.params.options),
    )
