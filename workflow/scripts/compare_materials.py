"""Put the comparisons of all materials side by side."""

from job import job

from pbrdf.fitting.comparison import gather

with job(snakemake.log[0]):
    gather(snakemake.input, snakemake.output.document, snakemake.output.rows)
