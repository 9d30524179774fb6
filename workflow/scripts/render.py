"""Render a material's sphere in an environment."""

from job import job

from pbrdf.report.environment_render import environment_render
from pbrdf.report.paper_figures import write_figure

with job(snakemake.log[0]):
    shown = environment_render(snakemake.input[0], snakemake.wildcards.material)
    write_figure(shown, snakemake.output)
