# A page a material, a page a calibration, and an index, each cached; then one folder of them that opens offline.


rule material_page:
    input:
        receipt="<results>/{material}/table.json",
        table=ancient("<results>/{material}/table.zarr"),
        fits=expand(
            "<results>/{{material}}/fit/{model}.json",
            model=SETTINGS["fitting"]["models"],
        ),
        comparison="<results>/{material}/comparison.json",
        consistency="<results>/{material}/consistency.json",
        calibrations=calibration_documents,
        images=image_receipts,
    output:
        page="<results>/pages/{material}.html",
        slices="<results>/pages/values/{material}.json",
        scripts=directory("<results>/pages/values/{material}"),
        entry="<results>/pages/parts/{material}.json",
    log:
        "<logs>/material_page/{material}.log",
    benchmark:
        "<benchmarks>/material_page/{material}.tsv"
    wildcard_constraints:
        material="|".join(filter(None, [spheres(), named("table")])),
    conda:
        "../../envs/report.yaml"
    resources:
        **asks("page"),
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
        page="<results>/pages/{material}.html",
        entry="<results>/pages/parts/{material}.json",
    log:
        "<logs>/image_page/{material}.log",
    benchmark:
        "<benchmarks>/image_page/{material}.tsv"
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
        page="<results>/pages/calibration_{subject}_{kind}.html",
        entry="<results>/pages/parts/calibration_{subject}_{kind}.json",
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
        entries=expand("<results>/pages/parts/{material}.json", material=MATERIALS),
        calibrations=calibration_entries(),
    output:
        "<results>/pages/index.html",
    log:
        "<logs>/index_page.log",
    benchmark:
        "<benchmarks>/index_page.tsv"
    conda:
        "../../envs/report.yaml"
    params:
        code=source_digest("pbrdf.report.material"),
    script:
        "../scripts/index_page.py"


rule report_folder:
    input:
        pages=[
            "<results>/pages/index.html",
            *expand("<results>/pages/{material}.html", material=MATERIALS),
            *calibration_pages(),
        ],
        slices=expand("<results>/pages/values/{material}.json", material=tabulated()),
        scripts=ancient(
            expand("<results>/pages/values/{material}", material=tabulated())
        ),
    output:
        report(
            directory("<results>/report"),
            htmlindex="index.html",
            category="Pages",
            caption="../../reports/pages.rst",
            labels={"open": "materials, fits, calibrations"},
        ),
    log:
        "<logs>/report_folder.log",
    benchmark:
        "<benchmarks>/report_folder.tsv"
    conda:
        "../../envs/report.yaml"
    params:
        plotly=plotly_version(),
        code=source_digest("pbrdf.report.folder"),
    script:
        "../scripts/report_folder.py"
