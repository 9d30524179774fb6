# A page a material, a page a calibration, and an index: one folder that opens offline.
from types import SimpleNamespace

from pbrdf.report.entries import calibration_link

CALIBRATED = (*KINDS, "flat", "sphere")


def calibrations_in_use():
    """Documents of all calibrations behind any material, each once."""
    documents = {}
    for name in MATERIALS:
        documents |= dict.fromkeys(
            calibration_documents(SimpleNamespace(material=name))
        )
    return list(documents)


def calibration_entries():
    """Lines of the index, one a calibration."""
    links = [Path(calibration_link(document)) for document in calibrations_in_use()]
    return [f"<results>/report/parts/{link.stem}.json" for link in links]


def calibration_subjects():
    """Pattern of what calibrations are of: sessions, and materials with spheres."""
    sessions = {m.session for m in MATERIALS.values() if m.session}
    return "|".join(map(re.escape, sorted(sessions | set(MATERIALS))))


def calibration_page_inputs(wildcards):
    """Input function: a calibration's document, and what it was measured from unless it came as a file."""
    kind, subject = wildcards.kind, wildcards.subject
    session = MATERIALS[subject].session if kind == "sphere" else subject
    folder = "<results>" if kind == "sphere" else "<results>/calibration"
    inputs = {"document": f"{folder}/{subject}/{kind}.json"}
    if kind in SETTINGS["calibration"]:
        return inputs
    if kind == "camera":
        inputs["photographs"] = board_manifests(subject)
    elif kind == "polarimeter":
        inputs["photographs"] = reference_manifests(subject)
    elif kind == "lights":
        inputs["photographs"] = session_manifests("chrome", subject)
    elif kind == "sphere":
        inputs["photographs"] = ambient_photographs(subject)
    elif kind == "flat":
        inputs["image"] = ancient(f"{folder}/{subject}/flat.exr")
    if kind in ("lights", "sphere"):
        inputs["camera"] = f"<results>/calibration/{session}/camera.json"
    return inputs


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
