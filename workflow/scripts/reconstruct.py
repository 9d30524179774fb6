"""Make the Mueller images of a light."""

from job import job

from pbrdf.reconstruction.light import reconstruct_light

with job(snakemake.log[0]):
    reconstruct_light(
        snakemake.input.manifest,
        {kind: path for kind, path in snakemake.input.items() if kind not in ("manifest", "flat_image")},
        snakemake.output.images,
        snakemake.output.receipt,
        margin_px=snakemake.params.margin_px,
        code=snakemake.params.code,
    )
