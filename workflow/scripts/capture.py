"""Photograph a material with the rig, lit by its lamp or by the room."""

import sys

from job import job

from pbrdf.capture.material import capture_material
from pbrdf.capture.preview import preview
from pbrdf.instruments.interface import FrameFormat
from pbrdf.settings.plan import CapturePlan

with job(snakemake.log[0]):
    plan, rig = CapturePlan.from_plain(snakemake.params.plan), snakemake.params.rig
    told = preview(plan, FrameFormat.of_camera(rig["camera"]), snakemake.params.folder)
    print(f"{snakemake.wildcards.material}: {told}", file=sys.stderr, flush=True)
    capture_material(
        plan,
        rig,
        snakemake.config["rig"],
        snakemake.wildcards.material,
        snakemake.params.radius_mm,
        snakemake.params.folder,
        ambient=snakemake.params.ambient,
    )
