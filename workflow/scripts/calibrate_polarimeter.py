"""Measure a session's polarimeter."""

from pathlib import Path

from job import job

from pbrdf.calibration.session_polarimeter import calibrate_polarimeter

with job(snakemake.log[0]):
    calibrate_polarimeter(
        {Path(manifest).parents[2].name: manifest for manifest in snakemake.input},
        snakemake.output[0],
    )
