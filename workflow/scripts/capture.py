"""Photograph a material with the rig, lit by its lamp or by the room."""

from job import job

from pbrdf.capture.material import capture_material
from pbrdf.settings.plan import CapturePlan

with job(snakemake.log[0]):
    capture_material(
        CapturePlan.from_plain(snakemake.params.plan),
        snakemake.params.rig,
        snakemake.config["rig"],
        snakemake.wildcards.material,
        snakemake.params.radius_mm,
        snakemake.params.folder,
        ambient=snakemake.params.ambient,
    )
