# A page a material, a page a calibration, and an index: one folder that opens offline.


rule material_page:
    input:
        receipt="<results>/{material}/table.json",
        table=ancient("<results>/{material}/table.zarr"),
        fit=f"<results>/{{material}}/fit/{SETTINGS['fitting']['models'][0]}.json",
        calibrations=calibration_documents,
    output:
        page=report(
            "<results>/report/{material}.html",
            category="Materials",
            caption="../../reports/material.rst",
            labels={"material": "{material}"},
        ),
        entry="<results>/report/parts/{material}.json",
    log:
        "<logs>/material_page/{material}.log",
    benchmark:
        "<benchmarks>/material_page/{material}.tsv"
    wildcard_constraints:
        material="|".join(filter(None, [spheres(), named("table")])),
    conda:
        "../../envs/report.yaml"
    params:
        code=source_digest("pbrdf.report.material"),
    script:
        "../scripts/material_page.py"


rule image_page:
    input:
        receipts=lambda wildcards: expand(
            "<results>/{material}/mueller/{light}.json",
            material=wildcards.material,
            light=lights(wildcards.material),
        ),
        images=lambda wildcards: ancient(
            expand(
                "<results>/{material}/mueller/{light}",
                material=wildcards.material,
                light=lights(wildcards.material),
            )
        ),
        calibrations=calibration_documents,
    output:
        page=report(
            "<results>/report/{material}.html",
            category="Materials",
            caption="../../reports/material.rst",
            labels={"material": "{material}"},
        ),
        entry="<results>/report/parts/{material}.json",
    log:
        "<logs>/image_page/{material}.log",
    wildcard_constraints:
        material="|".join(
            n
            for n, m in MATERIALS.items()
            if m.source != "table" and not has_sphere(n)
        )
        or "(?!)",
    conda:
        "../../envs/report.yaml"
    params:
        code=source_digest("pbrdf.report.material"),
    script:
        "../scripts/image_page.py"


rule calibration_page:
    input:
        unpack(calibration_page_inputs),
    output:
        page=report(
            "<results>/report/calibration_{subject}_{kind}.html",
            category="Calibrations",
            caption="../../reports/calibration.rst",
            labels={"calibration": "{kind}", "of": "{subject}"},
        ),
        entry="<results>/report/parts/calibration_{subject}_{kind}.json",
    log:
        "<logs>/calibration_page/{subject}_{kind}.log",
    benchmark:
        "<benchmarks>/calibration_page/{subject}_{kind}.tsv"
    wildcard_constraints:
        kind="|".join(CALIBRATED),
        subject=calibration_subjects(),
    conda:
        "../../envs/report.yaml"
    params:
        board=session_sections("board")["board"],
        code=source_digest("pbrdf.report.calibration_page"),
    script:
        "../scripts/calibration_page.py"


rule index_page:
    input:
        pages=expand("<results>/report/{material}.html", material=MATERIALS),
        entries=expand("<results>/report/parts/{material}.json", material=MATERIALS),
        calibrations=calibration_entries(),
    output:
        report(
            "<results>/report/index.html",
            category="Index",
            caption="../../reports/index.rst",
        ),
    log:
        "<logs>/index_page.log",
    conda:
        "../../envs/report.yaml"
    params:
        code=source_digest("pbrdf.report.material"),
    script:
        "../scripts/index_page.py"
