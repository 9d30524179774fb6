"""Write the index of the report."""

from job import job

from pbrdf.report.material import write_index

with job(snakemake.log[0]):
    write_index(snakemake.input.entries, snakemake.input.calibrations, snakemake.output[0])
