# Camera, polarimeter, lights and spheres: measured from a session's targets, or taken from the user's files.


localrules:
    calibrations,
    take_calibration,
    take_flat,
    take_sphere,


rule calibrations:
    input:
        lambda wildcards: calibrations_in_use(),


rule take_calibration:
    input:
        lambda wildcards: given_calibration(wildcards.kind, session=wildcards.session),
    output:
        "<results>/calibration/{session}/{kind}.json",
    log:
        "<logs>/take_calibration/{session}/{kind}.log",
    wildcard_constraints:
        session=SESSION,
        kind="|".join(kind for kind in KINDS if kind in SETTINGS["calibration"])
        or "(?!)",
    conda:
        "../../envs/calibration.yaml"
    params:
        kind="{kind}",
        code=source_digest("pbrdf.calibration.documents"),
    script:
        "../scripts/take_calibration.py"


use rule take_calibration as take_flat with:
    input:
        lambda wildcards: given_calibration("flat", session=wildcards.session),
    output:
        document="<results>/calibration/{session}/flat.json",
        image="<results>/calibration/{session}/flat.exr",
    log:
        "<logs>/take_calibration/{session}/flat.log",
    wildcard_constraints:
        session=taken("flat"),
    params:
        kind="flat",
        code=source_digest("pbrdf.calibration.documents"),


use rule take_calibration as take_sphere with:
    input:
        lambda wildcards: given_calibration("sphere", material=wildcards.material),
    output:
        "<results>/{material}/sphere.json",
    log:
        "<logs>/take_calibration/{material}.log",
    wildcard_constraints:
        material=taken("sphere", spheres()),
    params:
        kind="sphere",
        radius_mm=lambda wildcards: MATERIALS[wildcards.material].radius_mm,
        code=source_digest("pbrdf.calibration.documents"),


rule calibrate_camera:
    input:
        lambda wildcards: board_manifests(wildcards.session),
    output:
        "<results>/calibration/{session}/camera.json",
    log:
        "<logs>/calibrate_camera/{session}.log",
    benchmark:
        "<benchmarks>/calibrate_camera/{session}.tsv"
    wildcard_constraints:
        session=measured("camera"),
    conda:
        "../../envs/calibration.yaml"
    resources:
        **asks("calibrate", of_largest),
    params:
        board=session_sections("board")["board"],
        code=source_digest("pbrdf.calibration.session_camera"),
    script:
        "../scripts/calibrate_camera.py"


rule calibrate_polarimeter:
    input:
        lambda wildcards: reference_manifests(wildcards.session),
    output:
        "<results>/calibration/{session}/polarimeter.json",
    log:
        "<logs>/calibrate_polarimeter/{session}.log",
    benchmark:
        "<benchmarks>/calibrate_polarimeter/{session}.tsv"
    wildcard_constraints:
        session=measured("polarimeter"),
    conda:
        "../../envs/calibration.yaml"
    resources:
        **asks("calibrate", of_largest),
    params:
        code=source_digest("pbrdf.calibration.session_polarimeter"),
    script:
        "../scripts/calibrate_polarimeter.py"


rule calibrate_lights:
    input:
        chrome=lambda wildcards: session_manifests("chrome", wildcards.session),
        ambient=lambda wildcards: session_manifests("chrome_ambient", wildcards.session),
        camera="<results>/calibration/{session}/camera.json",
        polarimeter="<results>/calibration/{session}/polarimeter.json",
    output:
        "<results>/calibration/{session}/lights.json",
    log:
        "<logs>/calibrate_lights/{session}.log",
    benchmark:
        "<benchmarks>/calibrate_lights/{session}.tsv"
    wildcard_constraints:
        session=measured("lights"),
    conda:
        "../../envs/calibration.yaml"
    resources:
        **asks("calibrate", of_largest),
    params:
        radius_mm=SETTINGS["session"]["chrome"]["radius_mm"],
        arm=SETTINGS["session"].get("arm"),
        code=source_digest("pbrdf.calibration.session_lights"),
    script:
        "../scripts/calibrate_lights.py"


rule locate_sphere:
    input:
        ambient=lambda wildcards: ambient_photographs(wildcards.material),
        camera=session_document("camera"),
    output:
        "<results>/{material}/sphere.json",
    log:
        "<logs>/locate_sphere/{material}.log",
    benchmark:
        "<benchmarks>/locate_sphere/{material}.tsv"
    wildcard_constraints:
        material=measured("sphere", spheres()),
    conda:
        "../../envs/calibration.yaml"
    resources:
        **asks("calibrate"),
    params:
        radius_mm=lambda wildcards: MATERIALS[wildcards.material].radius_mm,
        code=source_digest("pbrdf.calibration.session_sphere"),
    script:
        "../scripts/locate_sphere.py"
