"""Write the page of a session's validation."""

from job import job

from pbrdf.report.validation import write_validation_page

with job(snakemake.log[0]):
    write_validation_page(snakemake.input[0], snakemake.output[0])
