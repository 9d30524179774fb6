"""Write a table of more than five bands for Mitsuba, five bands a file."""

from job import job

from pbrdf.tabulation.export import export_groups

with job(snakemake.log[0]):
    export_groups(
        snakemake.input.table,
        snakemake.output.folder,
        material=snakemake.wildcards.material,
        project=snakemake.params.project,
    )
