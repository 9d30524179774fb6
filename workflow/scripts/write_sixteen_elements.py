"""Write the made-up material that has all sixteen elements."""

from job import job

from pbrdf.models.sixteen_elements import write_sixteen_elements

with job(snakemake.log[0]):
    write_sixteen_elements(snakemake.output[0])
