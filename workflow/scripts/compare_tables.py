"""Compare two tables."""

from job import job

from pbrdf.report.comparison_page import write_comparison_page

with job(snakemake.log[0]):
    paths = (snakemake.input.first, snakemake.input.other)
    write_comparison_page(
        dict(zip(snakemake.params.names, paths, strict=True)),
        snakemake.output.page,
        snakemake.output.document,
    )
