"""Refuse a validation where the config photographs nothing."""

from job import job

from pbrdf.errors import InputError

with job(snakemake.log[0]):
    raise InputError(
        snakemake.params.config,
        "rig",
        "photographs no material, so there is no session to validate",
        "give `rig`, `plan` and a material of source `rig`",
    )
