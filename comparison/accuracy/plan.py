"""Plan of a scene's runs: what each model integrates, what it leaves out and why, and the cost."""

from dataclasses import dataclass, replace
from math import nan

from comparison.accuracy.measured import Expected, expected
from comparison.models import OWN, forces, joints_with_clearance
from comparison.scene import Scene

_BODIES = ("crank", "rod 2", "rocker", "rod 4", "slider")
_FREE = {"crank_pin": _BODIES[1:3], "slider": _BODIES[3:]}
"""Joint with clearance -> bodies whose motion is then not prescribed by the crank."""


@dataclass(frozen=True)
class Plan:
    """Plan of one model's run of a scene; ``formulation`` as the model records it with its result."""

    model: str
    formulation: str
    integrated: tuple[str, ...]  # bodies
    prescribed: tuple[str, ...]  # bodies whose motion follows from these and from the crank
    coordinates: int
    constraints: int
    contacts: tuple[str, ...]  # possible ones
    left_out: tuple[tuple[str, str], ...]  # not modelled, or not computed, and why
    expected: Expected
    instead: tuple[tuple[str, str, float], ...]  # other formulations: setting, words, ratio of their time


def plan(scene: Scene, model: str) -> Plan:
    """Return the plan of a built-in model for a scene; `ValueError` for another package's."""
    if model not in OWN:
        raise ValueError(f"model {model!r}: the plan of another package's model is not known")
    joints, ideal_slider = joints_with_clearance(scene.data), scene.data["joints"]["slider"] == "ideal"
    pin, rows = "crank_pin" in joints, 15 if ideal_slider else 13
    integrated = tuple(body for joint in joints for body in _FREE[joint])
    coordinates, constraints, instead, words = len(integrated), 0, "", ""
    named = scene.data["solver"][model]["formulation"]
    if model == "reference" and named == "multiplier":
        name = f"multiplier (15 coordinates, {rows} multipliers)"
        integrated, coordinates, constraints = _BODIES, 15, rows
    elif model == "reference":
        listed = f"{', '.join(integrated[:-1])} and {integrated[-1]}" if joints else ""
        name = f"minimal: {listed} ({coordinates} coordinates)" if joints else "closed form"
        if not pin:  # which the multipliers leave ideal
            instead, words = "multiplier", f"the paper's 15 coordinates and {rows} multipliers"
    elif named == "tree":
        name, integrated = f"{'rocker, rods' if pin else 'rod 4'} and slider tree", _BODIES[1 if pin else 3 :]
        # An ideal slider does not rotate: a point mass at the end of rod 4, constrained by the guide's force.
        coordinates = len(integrated) - ideal_slider
        instead, words = "full", "all five bodies with their joints, in steps that are short in contacts"
    else:
        name, integrated, coordinates = "five bodies", _BODIES, 15
        # Two rows for each of the pins O, A, B, H, C and F, the drive, and an ideal slider's two.
        constraints = rows - 2 * pin
        if joints and not forces(scene.data):
            instead, words = "tree", "only the free bodies, with error control"
    known, key = expected(scene, model), f"solver.{model}.formulation"
    # At the scene's settings of that formulation, which are its own.
    seconds = expected(scene.variant({key: instead}), model).seconds if instead else 0.0
    return Plan(
        model=model,
        formulation=name,
        integrated=integrated,
        prescribed=tuple(body for body in _BODIES if body not in integrated),
        coordinates=coordinates,
        constraints=constraints,
        contacts=_contacts(scene, joints),
        left_out=_left_out(scene, joints),
        expected=replace(known, error=nan) if known.far else known,
        instead=((f"{key} = {instead!r}", words, seconds / known.seconds),) if instead else (),
    )


def _contacts(scene: Scene, joints: tuple[str, ...]) -> tuple[str, ...]:
    contact = scene.data["contact"]

    def of_partners(key: str, factor: float) -> str:
        values = contact[key].values() if isinstance(contact[key], dict) else [contact[key]]
        return " on ".join(f"{factor * value:g}" for value in values)

    materials = f"{of_partners('youngs_modulus', 1e-9)} GPa, Poisson's ratio {of_partners('poisson', 1.0)}"
    possible = {
        "slider": f"four corners of the slider ({contact['law']}; {materials})",
        "crank_pin": "journal and bearing at the crank pin",
    }
    return tuple(text for joint, text in possible.items() if joint in joints)


def _left_out(scene: Scene, joints: tuple[str, ...]) -> tuple[tuple[str, str], ...]:
    contacts = {"crank_pin": "contact at the crank pin", "slider": "contact of the slider"}
    ideal = [(text, f"joints.{joint} is ideal") for joint, text in contacts.items() if joint not in joints]
    at_contacts = {"slider": "gaps and forces of the corners", "crank_pin": "path of the journal"}
    groups = {
        "accelerations": "accelerations",
        "corners": " and ".join(text for joint, text in at_contacts.items() if joint in joints),
        "joints": "reactions and the crank's torque",
        "energy": "energies",
    }
    requested = scene.data["output"]["groups"]
    omitted = [text for group, text in groups.items() if text and group not in requested]
    return *ideal, *((text, "not requested (output.groups)") for text in omitted)
