"""Merge the slices of a material into its table."""

from job import job

from pbrdf.tabulation.material import tabulate

with job(snakemake.log[0]):
    tabulate(
        snakemake.input.slices,
        snakemake.input.receipts,
        snakemake.output.table,
        snakemake.output.receipt,
        material=snakemake.wildcards.material,
        nodes=snakemake.params.nodes,
        fill_sigma=snakemake.params.fill_sigma,
        code=snakemake.params.code,
    )
