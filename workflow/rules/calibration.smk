# Calibrations of a session. Today they are copied from a virtual rig's file, or given by the user.


rule calibrate:
    input:
        given=lambda wildcards: given_calibration(
            wildcards.kind, session=wildcards.session
        ),
    output:
        "<results>/calibration/{session}/{kind}.json",
    log:
        "<logs>/calibrate/{session}/{kind}.log",
    wildcard_constraints:
        session="[A-Za-z0-9][A-Za-z0-9_-]*",
        kind="|".join(KINDS),
    conda:
        "../../envs/calibration.yaml"
    params:
        kind="{kind}",
        rig=RIG.without_spheres() if RIG else None,
        code=source_digest("pbrdf.calibration.documents"),
    script:
        "../scripts/calibrate.py"


use rule calibrate as calibrate_flat with:
    input:
        given=lambda wildcards: given_calibration("flat", session=wildcards.session),
    output:
        document="<results>/calibration/{session}/flat.json",
        image="<results>/calibration/{session}/flat.exr",
    log:
        "<logs>/calibrate/{session}/flat.log",
    params:
        kind="flat",
        rig=RIG.without_spheres() if RIG else None,
        code=source_digest("pbrdf.calibration.documents"),


rule locate_sphere:
    input:
        given=lambda wildcards: given_calibration("sphere", material=wildcards.material),
    output:
        "<results>/{material}/sphere.json",
    log:
        "<logs>/locate_sphere/{material}.log",
    wildcard_constraints:
        material=spheres(),
    conda:
        "../../envs/calibration.yaml"
    params:
        rig=RIG.without_spheres() if RIG else None,
        radius_mm=lambda wildcards: MATERIALS[wildcards.material].radius_mm,
        code=source_digest("pbrdf.calibration.documents"),
    script:
        "../scripts/locate_sphere.py"
