# Photographs: taken by the rig, or brought in from a folder of images. The code is no reason to take them again:
# what is taken is kept, and frames that another rig or plan would have taken are refused by the program itself.


localrules:
    capture_material,


rule capture_material:
    input:
        truth_files,
    output:
        planned_manifests(),
    log:
        "<logs>/capture_material/{material}.log",
    benchmark:
        "<benchmarks>/capture_material/{material}.tsv"
    wildcard_constraints:
        material=named("rig"),
    # the rig is never left waiting for the computer
    priority: 2
    conda:
        "../../envs/capture.yaml"
    resources:
        **asks("photograph", to_photograph),
        rig=1,
    params:
        plan=PLAN.plain() if PLAN else None,
        rig=lambda wildcards: RIG.with_sphere(wildcards.material, RIG_FILE),
        folder="captures/{material}",
        radius_mm=lambda wildcards: MATERIALS[wildcards.material].radius_mm,
        ambient=False,
    script:
        "../scripts/capture.py"


if photographed_sessions():

    localrules:
        capture,

    rule capture:
        input:
            [
                planned_manifests(name)
                for name, material in MATERIALS.items()
                if material.source == "rig"
            ],

else:

    rule capture:
        log:
            "<logs>/capture.log",
        params:
            config=config_name(),
        script:
            "../scripts/refuse_no_session.py"


rule import_images:
    input:
        images=lambda wildcards: image_files(wildcards.material, wildcards.light),
        form=lambda wildcards: MATERIALS[wildcards.material].path
        / IMAGES[wildcards.material][0].file,
        details=lambda wildcards: MATERIALS[wildcards.material].details,
    output:
        "captures/{material}/lights/{light}/manifest.json",
    log:
        "<logs>/import_images/{material}/{light}.log",
    benchmark:
        "<benchmarks>/import_images/{material}/{light}.tsv"
    wildcard_constraints:
        material=named("images"),
    conda:
        "../../envs/capture.yaml"
    resources:
        **asks("import_images"),
    params:
        folder=lambda wildcards: str(MATERIALS[wildcards.material].path),
        capture="captures/{material}",
        code=source_digest("pbrdf.capture.images"),
    script:
        "../scripts/import_images.py"
