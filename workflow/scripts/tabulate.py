"""Merge the slices of a material into its table."""

from job import job

from pbrdf.tabulation.material import Tabulation, tabulate

with job(snakemake.log[0]):
    tabulate(
        snakemake.input.slices,
        snakemake.input.receipts,
        snakemake.output.table,
        snakemake.output.consistency,
        snakemake.output.receipt,
        material=snakemake.wildcards.material,
        settings=Tabulation(
            snakemake.params.nodes,
            snakemake.params.widest_gap_deg,
            snakemake.params.symmetrise,
            snakemake.params.fill_sigma,
            snakemake.params.mapping,
            tuple(snakemake.params.slips),
        ),
        code=snakemake.params.code,
    )
