"""Measure where a session's lights stand."""

from job import job

from pbrdf.calibration.arm_problem import GivenRadius
from pbrdf.calibration.session_lights import calibrate_lights

with job(snakemake.log[0]):
    arm = snakemake.params.arm
    calibrate_lights(
        snakemake.input.chrome,
        snakemake.input.ambient[0],
        snakemake.input.camera,
        snakemake.input.polarimeter,
        snakemake.params.radius_mm,
        GivenRadius(arm["radius_mm"], arm["deviation_mm"]) if arm else None,
        snakemake.output[0],
    )
