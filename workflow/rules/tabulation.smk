# Mueller images to slices, slices to the table of a material, and the table to renderers.


rule slice:
    input:
        receipt="<results>/{material}/mueller/{light}.json",
        images=ancient("<results>/{material}/mueller/{light}"),
        manifest=manifest,
        sphere="<results>/{material}/sphere.json",
        camera=session_document("camera"),
        lights=session_document("lights"),
        polarimeter=session_document("polarimeter"),
        radiometry=session_document("radiometry"),
    output:
        slice=directory("<results>/{material}/slices/{light}.zarr"),
        receipt="<results>/{material}/slices/{light}.json",
    log:
        "<logs>/slice/{material}/{light}.log",
    benchmark:
        "<benchmarks>/slice/{material}/{light}.tsv"
    wildcard_constraints:
        material=spheres(),
        light=LIGHT,
    # images that are not kept go with their slice: it comes before the images of another light
    priority: 1
    conda:
        "../../envs/tabulation.yaml"
    threads: threads_of("slice")
    resources:
        **asks("slice"),
    params:
        nodes=NODES,
        grazing_deg=SETTINGS["tabulation"]["grazing_deg"],
        paper=paper_mapping,
        code=source_digest("pbrdf.tabulation.light"),
    script:
        "../scripts/slice.py"


rule tabulate:
    input:
        receipts=lambda wildcards: expand(
            "<results>/{material}/slices/{light}.json",
            material=wildcards.material,
            light=lights(wildcards.material),
        ),
        slices=lambda wildcards: ancient(
            expand(
                "<results>/{material}/slices/{light}.zarr",
                material=wildcards.material,
                light=lights(wildcards.material),
            )
        ),
    output:
        table=directory("<results>/{material}/table.zarr"),
        consistency="<results>/{material}/consistency.json",
        receipt="<results>/{material}/table.json",
    log:
        "<logs>/tabulate/{material}.log",
    benchmark:
        "<benchmarks>/tabulate/{material}.tsv"
    wildcard_constraints:
        material=spheres(),
    conda:
        "../../envs/tabulation.yaml"
    resources:
        **asks("tabulate"),
    params:
        nodes=NODES,
        widest_gap_deg=SETTINGS["tabulation"]["widest_gap_deg"],
        symmetrise=SETTINGS["tabulation"]["symmetrise"],
        fill_sigma=SETTINGS["tabulation"]["fill_sigma"],
        mapping=SETTINGS["tabulation"]["mapping"],
        slips=SETTINGS["tabulation"]["slips"],
        code=source_digest("pbrdf.tabulation.material"),
    script:
        "../scripts/tabulate.py"


rule import_table:
    input:
        source=lambda wildcards: MATERIALS[wildcards.material].path,
        axes=lambda wildcards: [
            path for path in [MATERIALS[wildcards.material].details] if path
        ],
    output:
        table=directory("<results>/{material}/table.zarr"),
        consistency="<results>/{material}/consistency.json",
        receipt="<results>/{material}/table.json",
    log:
        "<logs>/import_table/{material}.log",
    benchmark:
        "<benchmarks>/import_table/{material}.tsv"
    wildcard_constraints:
        material=named("table"),
    conda:
        "../../envs/tabulation.yaml"
    resources:
        **asks("import_table"),
    params:
        code=source_digest("pbrdf.tabulation.material"),
    script:
        "../scripts/import_table.py"


rule export:
    input:
        receipt="<results>/{material}/table.json",
        table=ancient("<results>/{material}/table.zarr"),
    output:
        raw="<results>/{material}/{material}.pbsdf",
        filled="<results>/{material}/{material}_filled.pbsdf",
    log:
        "<logs>/export/{material}.log",
    benchmark:
        "<benchmarks>/export/{material}.tsv"
    conda:
        "../../envs/tabulation.yaml"
    resources:
        **asks("export"),
    params:
        project=SETTINGS["tabulation"]["project"],
        code=source_digest("pbrdf.tabulation.export"),
    script:
        "../scripts/export.py"


# Mitsuba reads five bands a file: more of them become several, in a folder.
rule export_groups:
    input:
        receipt="<results>/{material}/table.json",
        table=ancient("<results>/{material}/table.zarr"),
    output:
        folder=directory("<results>/{material}/pbsdf"),
    log:
        "<logs>/export_groups/{material}.log",
    benchmark:
        "<benchmarks>/export_groups/{material}.tsv"
    conda:
        "../../envs/tabulation.yaml"
    resources:
        **asks("export"),
    params:
        project=SETTINGS["tabulation"]["project"],
        code=source_digest("pbrdf.tabulation.export"),
    script:
        "../scripts/export_groups.py"
