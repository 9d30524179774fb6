"""Fit a model to a table."""

from job import job

from pbrdf.fitting.material import fit_material

with job(snakemake.log[0]):
    fit_material(
        snakemake.input.table,
        snakemake.input.receipt,
        snakemake.wildcards.model,
        snakemake.output[0],
        downsample=snakemake.params.downsample,
        starts=snakemake.params.starts,
        seed=snakemake.params.seed,
    )
