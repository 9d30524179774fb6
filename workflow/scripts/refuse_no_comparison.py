"""Refuse to compare where the config names no two tables."""

from job import job

from pbrdf.errors import InputError

with job(snakemake.log[0]):
    raise InputError(
        snakemake.params.config,
        "compare",
        "does not name two tables",
        "run snakemake compare --config 'compare=[gold,other.pbsdf]'",
    )
