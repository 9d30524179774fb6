# Targets of a calibration session, and spheres under ambient light: `snakemake capture_calibration` takes them all.


localrules:
    capture_target,
    capture_chrome,
    capture_spectralon,
    capture_boards,
    capture_ambient,


rule capture_target:
    output:
        f"{SESSION_FOLDER}/{{target}}/lights/{{light}}/manifest.json",
    log:
        "<logs>/capture_target/{session}/{target}_{light}.log",
    benchmark:
        "<benchmarks>/capture_target/{session}/{target}_{light}.tsv"
    wildcard_constraints:
        session="|".join(photographed_sessions()) or "(?!)",
        target="|".join([*IDEAL, "flat"]),
        light=LIGHT,
    # what all materials wait for comes first, then materials: one is worked on while the next is photographed
    priority: 3
    conda:
        "../../envs/capture.yaml"
    resources:
        **asks("photograph", of_targets()),
        rig=1,
    params:
        plans=lambda wildcards: plain_plans([wildcards.target]),
        rig=RIG.with_no_sphere() if RIG else None,
        session=lambda wildcards: session_sections(wildcards.target),
        folder=SESSION_FOLDER,
    script:
        "../scripts/capture_target.py"


use rule capture_target as capture_chrome with:
    output:
        target_manifests("chrome"),
        target_manifests("chrome_ambient"),
    log:
        "<logs>/capture_chrome/{session}.log",
    benchmark:
        "<benchmarks>/capture_chrome/{session}.tsv"
    resources:
        **asks("photograph", of_targets("chrome", "chrome_ambient")),
        rig=1,
    params:
        plans=plain_plans(["chrome", "chrome_ambient"]),
        rig=RIG.with_no_sphere() if RIG else None,
        session=session_sections("chrome"),
        folder=SESSION_FOLDER,


use rule capture_target as capture_spectralon with:
    output:
        target_manifests("spectralon"),
    log:
        "<logs>/capture_spectralon/{session}.log",
    benchmark:
        "<benchmarks>/capture_spectralon/{session}.tsv"
    resources:
        **asks("photograph", of_targets("spectralon")),
        rig=1,
    params:
        plans=plain_plans(["spectralon"]),
        rig=RIG.with_no_sphere() if RIG else None,
        session=session_sections("spectralon"),
        folder=SESSION_FOLDER,


use rule capture_target as capture_boards with:
    output:
        [target_manifests(board) for board in boards()],
    log:
        "<logs>/capture_boards/{session}.log",
    benchmark:
        "<benchmarks>/capture_boards/{session}.tsv"
    resources:
        **asks("photograph", of_targets(*boards())),
        rig=1,
    params:
        plans=plain_plans(boards()),
        rig=RIG.with_no_sphere() if RIG else None,
        session=session_sections("board"),
        folder=SESSION_FOLDER,


rule capture_ambient:
    input:
        truth_files,
    output:
        ambient_manifest(),
    log:
        "<logs>/capture_ambient/{material}.log",
    benchmark:
        "<benchmarks>/capture_ambient/{material}.tsv"
    wildcard_constraints:
        material=named("rig"),
    priority: 3
    conda:
        "../../envs/capture.yaml"
    resources:
        **asks("photograph", of_ambient),
        rig=1,
    params:
        plan=AMBIENT_PLAN.plain() if AMBIENT_PLAN else None,
        rig=lambda wildcards: RIG.with_sphere(wildcards.material, RIG_FILE),
        folder="captures/{material}/ambient",
        radius_mm=lambda wildcards: MATERIALS[wildcards.material].radius_mm,
        ambient=True,
    script:
        "../scripts/capture.py"


if photographed_sessions():

    localrules:
        capture_calibration,

    rule capture_calibration:
        input:
            [
                target_manifests(target, session)
                for session in photographed_sessions()
                for target in TARGET_PLANS
            ],
            [
                ambient_manifest(name)
                for name, material in MATERIALS.items()
                if material.source == "rig"
            ],

else:

    rule capture_calibration:
        log:
            "<logs>/capture_calibration.log",
        params:
            config=config_name(),
        script:
            "../scripts/refuse_no_session.py"
