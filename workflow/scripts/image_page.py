"""Write the page of an object that is no sphere."""

from job import job

from pbrdf.report.material import write_image_page

with job(snakemake.log[0]):
    write_image_page(
        snakemake.wildcards.material,
        snakemake.input.images,
        snakemake.input.receipts,
        snakemake.input.calibrations,
        snakemake.output.page,
        snakemake.output.entry,
    )
