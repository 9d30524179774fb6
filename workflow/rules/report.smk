# A page a material and an index: one folder that opens offline.


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


rule index_page:
    input:
        pages=expand("<results>/report/{material}.html", material=MATERIALS),
        entries=expand("<results>/report/parts/{material}.json", material=MATERIALS),
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
