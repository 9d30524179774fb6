"""Write the page of the closed loop."""

from job import job

from pbrdf.report.closed_loop import write_closed_loop_page

with job(snakemake.log[0]):
    write_closed_loop_page(snakemake.input, snakemake.output[0])
