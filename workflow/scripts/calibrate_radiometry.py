"""Measure noise and range of a session's camera, and the power of its lamp."""

from job import job

from pbrdf.reconstruction.session_radiometry import calibrate_radiometry

with job(snakemake.log[0]):
    calibrate_radiometry(
        snakemake.input.bright_field[0],
        list(snakemake.input.tile),
        {kind: snakemake.input[kind] for kind in ("camera", "polarimeter", "lights", "flat")},
        snakemake.params.reflectance,
        snakemake.output[0],
    )
