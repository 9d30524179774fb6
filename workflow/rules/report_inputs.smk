# What the pages of calibrations are made from, and which there are.
from importlib.metadata import PackageNotFoundError, version
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


def calibration_pages():
    """Pages of calibrations."""
    return [f"<results>/pages/{calibration_link(d)}" for d in calibrations_in_use()]


def calibration_entries():
    """Lines of the index, one a calibration."""
    links = [Path(calibration_link(document)) for document in calibrations_in_use()]
    return [f"<results>/pages/parts/{link.stem}.json" for link in links]


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


def plotly_version():
    """Version of Plotly, whose script the folder of the report holds; a job refuses where there is none."""
    try:
        return version("plotly")
    except PackageNotFoundError:
        return "none"


def image_receipts(wildcards):
    """Input function: receipts of the Mueller images behind a material's table."""
    material = wildcards.material
    if MATERIALS[material].source == "table":
        return []
    return expand(
        "<results>/{material}/mueller/{light}.json",
        material=material,
        light=lights(material),
    )
