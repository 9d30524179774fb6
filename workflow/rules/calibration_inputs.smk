# Which calibrations a material needs, and where each comes from: measured in its session, or a file of the config.


def session_document(kind):
    """Input function: a calibration of a material's session."""

    def document(wildcards):
        session = MATERIALS[wildcards.material].session
        return f"<results>/calibration/{session}/{kind}.json"

    return document


def given_calibration(kind, material="", session=""):
    """The file that the config gives for a calibration, in a list; none where it gives none."""
    path = SETTINGS["calibration"].get(kind)
    if not path:
        return []
    return [placed(path.replace("{material}", material).replace("{session}", session))]


def measured(kind, names=SESSION):
    """Pattern of what a calibration is measured for: nothing where the config gives a file."""
    return "(?!)" if kind in SETTINGS["calibration"] else names


def taken(kind, names=SESSION):
    """Pattern of what a calibration is taken from a file for."""
    return names if kind in SETTINGS["calibration"] else "(?!)"


def is_available(kind, material):
    """Whether the config gives a calibration of a material, or its targets are there or can be photographed."""
    if kind in SETTINGS["calibration"]:
        return True
    session = MATERIALS[material].session
    photographs = {
        "camera": [board_manifests(session)],
        "polarimeter": [reference_manifests(session)],
        "lights": [
            session_manifests("chrome", session),
            session_manifests("chrome_ambient", session),
        ],
        "flat": [session_manifests("flat", session)],
        "radiometry": [
            session_manifests("flat", session),
            session_manifests("spectralon", session),
        ],
        "sphere": [ambient_photographs(material)],
    }[kind]
    earlier = {
        "lights": ["camera", "polarimeter"],
        "radiometry": ["camera", "polarimeter", "lights"],
        "sphere": ["camera"],
    }.get(kind, [])
    return all(photographs) and all(is_available(each, material) for each in earlier)


def image_calibrations(wildcards):
    """What a light's reconstruction needs, by kind."""
    sphere = has_sphere(wildcards.material)
    kinds = ["polarimeter", *(["camera"] if sphere else [])]
    optional = ("radiometry", "flat")
    kinds += [kind for kind in optional if is_available(kind, wildcards.material)]
    documents = {kind: session_document(kind)(wildcards) for kind in kinds}
    if "flat" in kinds:
        documents["flat_image"] = ancient(documents["flat"].replace(".json", ".exr"))
    if sphere:
        documents["sphere"] = f"<results>/{wildcards.material}/sphere.json"
    return documents


def calibration_documents(wildcards):
    """All calibrations behind a material's page."""
    material = wildcards.material
    if MATERIALS[material].source == "table":
        return []
    if not has_sphere(material):
        documents = image_calibrations(wildcards)
        return [path for kind, path in documents.items() if kind != "flat_image"]
    kinds = [*KINDS, *(["flat"] if "flat" in image_calibrations(wildcards) else [])]
    session = [session_document(kind)(wildcards) for kind in kinds]
    return [*session, f"<results>/{material}/sphere.json"]
