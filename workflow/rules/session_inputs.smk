# The photographs of a session: what the rig will take, and what is there.

from pbrdf.optics.elements import IDEAL
from pbrdf.settings.rig import sphere_files
from pbrdf.settings.targets import AMBIENT, board_names

SESSION_FOLDER = "captures/_sessions/{session}"


def takes_photographs():
    """Whether anything drives the rig."""
    return RIG is not None and RIG["kind"] == "virtual"


def photographed_sessions():
    """Sessions whose polarimeter the rig can put to the test."""
    return sorted({m.session for m in MATERIALS.values() if m.source == "rig"})


def planned_manifests(material="{material}"):
    """Manifests of all lights of a sphere that the rig photographs."""
    planned = [light.id for light in PLAN.lights] if PLAN else ["none"]
    return [f"captures/{material}/lights/{light}/manifest.json" for light in planned]


def target_manifests(target, session="{session}"):
    """Manifests of a target of a session, one a light."""
    folder = f"{SESSION_FOLDER}/{target}".format(session=session)
    plan = TARGET_PLANS.get(target)
    return [
        f"{folder}/lights/{light.id}/manifest.json"
        for light in (plan.lights if plan else [])
    ] or [f"{folder}/lights/none/manifest.json"]


def plain_plans(targets):
    """Plans of targets as parameters."""
    return {
        name: TARGET_PLANS[name].plain() for name in targets if name in TARGET_PLANS
    }


def session_sections(*names):
    """What of the config's `session` a target depends on: another's change is no reason to go to the rig."""
    return {
        name: SETTINGS["session"][name] for name in names if name in SETTINGS["session"]
    }


def boards():
    """Targets that show the chessboard."""
    return board_names(SETTINGS["session"]["board"]["views"])


def ambient_manifest(material="{material}"):
    """Manifest of a material's sphere under ambient light."""
    return f"captures/{material}/ambient/lights/{AMBIENT.id}/manifest.json"


def session_manifests(target, session):
    """Manifests of a target: those that the rig will take, or those that are there."""
    if takes_photographs() and session in photographed_sessions():
        return target_manifests(target, session)
    folder = Path(SESSION_FOLDER.format(session=session))
    return sorted(map(str, folder.glob(f"{target}/lights/*/manifest.json")))


def truth_files(wildcards):
    """Input function: the table or Mitsuba's files that a material's virtual sphere is made of."""
    return sphere_files(RIG.get("spheres", {}).get(wildcards.material))


def board_manifests(session):
    """Manifests of a session's views of the board."""
    if takes_photographs() and session in photographed_sessions():
        return [path for board in boards() for path in target_manifests(board, session)]
    return session_manifests("board_*", session)


def reference_manifests(session):
    """Manifests of the elements that a session's polarimeter is calibrated with; none if one is missing."""
    names = SETTINGS["session"]["polarimeter_references"]
    manifests = [session_manifests(name, session) for name in names]
    return sum(manifests, []) if all(manifests) else []


def ambient_photographs(material):
    """Manifest of a material's sphere under ambient light, in a list; none if there is none."""
    if takes_photographs() and MATERIALS[material].source == "rig":
        return [ambient_manifest(material)]
    folder = capture_folder(material) / "ambient"
    return sorted(map(str, folder.glob("lights/*/manifest.json")))[:1]


def element_manifests(wildcards):
    """Input function: the manifests of a session's elements, by element."""
    return {
        element: target_manifests(element, wildcards.session)[0] for element in IDEAL
    }


def validation_pages():
    """A page a session."""
    return expand(
        "<results>/pages/validation_{session}.html", session=photographed_sessions()
    )
