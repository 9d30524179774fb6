"""Write a table for Mitsuba, raw and filled."""

from job import job

from pbrdf.tabulation.export import export_pbsdf

with job(snakemake.log[0]):
    export_pbsdf(
        snakemake.input.table,
        snakemake.output.raw,
        snakemake.output.filled,
        project=snakemake.params.project,
    )
