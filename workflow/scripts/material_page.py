"""Write the page of a material."""

from job import job

from pbrdf.report.material import write_material_page

with job(snakemake.log[0]):
    write_material_page(
        snakemake.wildcards.material,
        snakemake.input.table,
        snakemake.input.receipt,
        snakemake.input.fits,
        snakemake.input.comparison,
        snakemake.input.consistency,
        snakemake.input.get("calibrations", []),
        snakemake.input.get("images", []),
        snakemake.output.page,
        snakemake.output.slices,
        snakemake.output.scripts,
        snakemake.output.entry,
    )
