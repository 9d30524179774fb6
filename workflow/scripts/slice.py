"""Make the slice of the table that a light shows, or its share by the supplement's map."""

from job import job

from pbrdf.tabulation.light import share_light, slice_light

CALIBRATIONS = ("camera", "sphere", "lights", "polarimeter", "radiometry")

with job(snakemake.log[0]):
    make = share_light if snakemake.params.paper else slice_light
    make(
        snakemake.input.images,
        snakemake.input.receipt,
        snakemake.input.manifest,
        {kind: snakemake.input[kind] for kind in CALIBRATIONS},
        snakemake.output.slice,
        snakemake.output.receipt,
        nodes=snakemake.params.nodes,
        grazing_deg=snakemake.params.grazing_deg,
        code=snakemake.params.code,
        **(snakemake.params.paper or {}),
    )
