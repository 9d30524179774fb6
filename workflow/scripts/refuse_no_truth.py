"""Refuse a closed loop where no material is known from which the photographs were computed."""

from job import job

from pbrdf.errors import InputError

with job(snakemake.log[0]):
    raise InputError(
        snakemake.params.config,
        "rig",
        "photographs no virtual sphere in five bands",
        "run `snakemake closed_loop --configfile config/closed_loop.yaml`",
    )
