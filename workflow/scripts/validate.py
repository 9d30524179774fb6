"""Hold a session's elements against their ideal matrices."""

from job import job

from pbrdf.reconstruction.validation import validate_session

with job(snakemake.log[0]):
    validate_session(
        snakemake.wildcards.session,
        {element: snakemake.input[element] for element in snakemake.params.elements},
        {kind: snakemake.input[kind] for kind in ("polarimeter", "radiometry", "lights")},
        snakemake.output[0],
    )
