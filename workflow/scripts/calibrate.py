"""Write a calibration of a session: the user's file, or a copy of the virtual rig's values."""

from job import job

from pbrdf.calibration.documents import write_given, write_nominal

with job(snakemake.log[0]):
    kind = snakemake.params.kind
    if snakemake.input.given:
        write_given(kind, snakemake.input.given[0], snakemake.output[0])
    else:
        write_nominal(kind, snakemake.params.rig, snakemake.output[0])
