"""Bring in a table in another format."""

from job import job

from pbrdf.tabulation.material import import_table

with job(snakemake.log[0]):
    import_table(
        snakemake.input.source,
        next(iter(snakemake.input.axes), None),
        snakemake.output.table,
        snakemake.output.consistency,
        snakemake.output.receipt,
        material=snakemake.wildcards.material,
        code=snakemake.params.code,
    )
