# Known elements in the beam, measured beside ideal: `snakemake validation`. No part of a bare `snakemake`.


rule capture_element:
    output:
        ELEMENT_MANIFEST,
    log:
        "<logs>/capture_element/{session}/{element}.log",
    benchmark:
        "<benchmarks>/capture_element/{session}/{element}.tsv"
    wildcard_constraints:
        session="|".join(photographed_sessions()) or "(?!)",
        element="|".join(IDEAL),
    conda:
        "../../envs/capture.yaml"
    resources:
        rig=1,
    params:
        plan=ELEMENT_PLAN.plain() if ELEMENT_PLAN else None,
        rig=RIG.with_no_sphere() if RIG else None,
        folder=ELEMENT_FOLDER,
    script:
        "../scripts/capture_element.py"


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
            "<results>/report/validation_{session}.html",
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

else:

    rule validation:
        log:
            "<logs>/validation.log",
        params:
            config=config_name(),
        script:
            "../scripts/refuse_validation.py"
