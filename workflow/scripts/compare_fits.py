"""Compare the fits of a material with its table and with each other."""

from job import job

from pbrdf.fitting.comparison import compare_material

with job(snakemake.log[0]):
    compare_material(
        snakemake.wildcards.material,
        snakemake.input.table,
        snakemake.input.fits,
        snakemake.output.document,
        snakemake.output.rows,
    )
