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
        widest_gap_deg=snakemake.params.widest_gap_deg,
        fill_sigma=snakemake.params.fill_sigma,
        code=snakemake.params.code,
    )
