"""Photograph an optical element in the beam of the rig."""

from job import job

from pbrdf.capture.session import capture_target
from pbrdf.settings.plan import CapturePlan

with job(snakemake.log[0]):
    capture_target(
        CapturePlan.from_plain(snakemake.params.plan),
        snakemake.params.rig,
        snakemake.config["rig"],
        snakemake.wildcards.element,
        snakemake.params.folder,
    )
