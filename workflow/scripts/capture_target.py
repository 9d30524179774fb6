"""Photograph targets of a session with the rig, one after the other."""

from job import job

from pbrdf.capture.session import capture_target
from pbrdf.settings.plan import CapturePlan

with job(snakemake.log[0]):
    for target, plan in snakemake.params.plans.items():
        capture_target(
            CapturePlan.from_plain(plan),
            snakemake.params.rig,
            snakemake.config["rig"],
            target,
            snakemake.params.session,
            f"{snakemake.params.folder}/{target}",
        )
