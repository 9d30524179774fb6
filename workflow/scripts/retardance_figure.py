"""Draw a session's retardances for papers."""

from job import job

from pbrdf.report.paper_figures import retardance_figure, write_figure

with job(snakemake.log[0]):
    write_figure(retardance_figure(snakemake.input[0]), snakemake.output)
