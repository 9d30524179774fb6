"""Gather the pages in one folder."""

from job import job

from pbrdf.report.folder import assemble_report

with job(snakemake.log[0]):
    assemble_report(
        snakemake.input.pages, snakemake.input.slices, snakemake.input.scripts, snakemake.output[0]
    )
