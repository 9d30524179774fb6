"""Hold a material's exported tables against what the virtual rig photographed."""

from job import job

from pbrdf.tabulation.closed_loop import EXPORTS, compare_with_truth

with job(snakemake.log[0]):
    compare_with_truth(
        snakemake.wildcards.material,
        snakemake.params.sphere,
        snakemake.config["rig"],
        {export: snakemake.input[export] for export in EXPORTS},
        snakemake.output[0],
        tuple(snakemake.params.bands_nm),
    )
