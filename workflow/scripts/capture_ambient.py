"""Photograph a material's sphere under ambient light."""

from job import job

from pbrdf.capture.material import capture_ambient
from pbrdf.settings.plan import CapturePlan

with job(snakemake.log[0]):
    capture_ambient(
        CapturePlan.from_plain(snakemake.params.plan),
        snakemake.params.rig,
        snakemake.config["rig"],
        snakemake.wildcards.material,
        snakemake.params.radius_mm,
        snakemake.params.folder,
    )
