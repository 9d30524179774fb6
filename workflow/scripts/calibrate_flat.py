"""Measure the flat field of a session's camera."""

from job import job

from pbrdf.reconstruction.session_radiometry import calibrate_flat

with job(snakemake.log[0]):
    calibrate_flat(snakemake.input[0], snakemake.output.document)
