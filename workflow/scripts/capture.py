"""Photograph a material with the rig."""

from job import job

from pbrdf.capture.material import capture_material

with job(snakemake.log[0]):
    capture_material(
        snakemake.params.plan,
        snakemake.params.rig,
        snakemake.params.rig_file,
        snakemake.wildcards.material,
        snakemake.params.radius_mm,
        snakemake.params.folder,
    )
