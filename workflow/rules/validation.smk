# Known elements in the beam, measured beside ideal: `snakemake validation`. No part of a bare `snakemake`.


rule validate:
    input:
        unpack(element_manifests),
        polarimeter="<results>/calibration/{session}/polarimeter.json",
        radiometry="<results>/calibration/{session}/radiometry.json",
        lights="<results>/calibration/{session}/lights.json",
    output:
        "<results>/validation/{session}.json",
    log:
        "<logs>/validate/{session}.log",
    benchmark:
        "<benchmarks>/validate/{session}.tsv"
    conda:
        "../../envs/reconstruction.yaml"
    params:
        elements=list(IDEAL),
        code=source_digest("pbrdf.reconstruction.validation"),
    script:
        "../scripts/validate.py"


rule validation_page:
    input:
        "<results>/validation/{session}.json",
    output:
        report(
            "<results>/pages/validation_{session}.html",
            category="Validation",
            caption="../../reports/validation.rst",
            labels={"session": "{session}"},
        ),
    log:
        "<logs>/validation_page/{session}.log",
    conda:
        "../../envs/report.yaml"
    params:
        code=source_digest("pbrdf.report.validation"),
    script:
        "../scripts/validation_page.py"


if photographed_sessions():

    localrules:
        validation,

    rule validation:
        input:
            validation_pages(),
            # they are linked to
            expand(
                "<results>/pages/calibration_{session}_{kind}.html",
                session=photographed_sessions(),
                kind=["polarimeter", "radiometry", "lights"],
            ),

else:

    rule validation:
        log:
            "<logs>/validation.log",
        params:
            config=config_name(),
        script:
            "../scripts/refuse_no_session.py"
