"""Refuse to photograph or judge a session where the config photographs nothing."""

from job import job

from pbrdf.errors import InputError

with job(snakemake.log[0]):
    raise InputError(
        snakemake.params.config,
        "rig",
        "photographs no material, so there is no session",
        "give `rig`, `plan` and a material of source `rig`",
    )
