"""Draw a material's figures for papers."""

from job import job

from pbrdf.report.paper_figures import write_material_figures

with job(snakemake.log[0]):
    write_material_figures(snakemake.input.table, snakemake.input.fits, snakemake.output)
