# Flat field and radiometry of a session: measured from its bright field and its Spectralon tile.


rule calibrate_flat:
    input:
        lambda wildcards: session_manifests("flat", wildcards.session),
    output:
        document="<results>/calibration/{session}/flat.json",
        image="<results>/calibration/{session}/flat.exr",
    log:
        "<logs>/calibrate_flat/{session}.log",
    benchmark:
        "<benchmarks>/calibrate_flat/{session}.tsv"
    wildcard_constraints:
        session=measured("flat"),
    conda:
        "../../envs/calibration.yaml"
    resources:
        **asks("calibrate", of_largest),
    params:
        code=source_digest("pbrdf.reconstruction.session_radiometry"),
    script:
        "../scripts/calibrate_flat.py"


rule calibrate_radiometry:
    input:
        bright_field=lambda wildcards: session_manifests("flat", wildcards.session),
        tile=lambda wildcards: session_manifests("spectralon", wildcards.session),
        camera="<results>/calibration/{session}/camera.json",
        polarimeter="<results>/calibration/{session}/polarimeter.json",
        lights="<results>/calibration/{session}/lights.json",
        flat="<results>/calibration/{session}/flat.json",
        flat_image=ancient("<results>/calibration/{session}/flat.exr"),
    output:
        "<results>/calibration/{session}/radiometry.json",
    log:
        "<logs>/calibrate_radiometry/{session}.log",
    benchmark:
        "<benchmarks>/calibrate_radiometry/{session}.tsv"
    wildcard_constraints:
        session=measured("radiometry"),
    conda:
        "../../envs/calibration.yaml"
    resources:
        **asks("reconstruct", of_largest),
    params:
        reflectance=SETTINGS["session"]["spectralon"]["reflectance"],
        code=source_digest("pbrdf.reconstruction.session_radiometry"),
    script:
        "../scripts/calibrate_radiometry.py"
