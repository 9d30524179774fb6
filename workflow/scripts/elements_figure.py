"""Draw a session's elements in the beam for papers."""

from job import job

from pbrdf.report.paper_figures import elements_figure, write_figure

with job(snakemake.log[0]):
    write_figure(elements_figure(snakemake.input[0]), snakemake.output)
