"""Plan of a scene's runs: what each model integrates, what it leaves out and why, and the cost.

The models make these choices themselves; this module describes them before a run. The contract tests compare
the names and numbers with those recorded by the models.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite

from comparison.accuracy.levels import Expected, expected
from comparison.models import OWN, forces, joints_with_clearance
from comparison.scene import Scene
from comparison.tables import channels

_CHAIN = {  # coordinates of the equations, by the joints with clearance
    (): "closed form",
    ("slider",): "minimal: rod 4 and slider (2 coordinates)",
    ("crank_pin",): "minimal: rod 2 and rocker (2 coordinates)",
    ("crank_pin", "slider"): "minimal: rod 2, rocker, rod 4 and slider (4 coordinates)",
}
_FREE = {
    (): (),
    ("slider",): ("rod 4", "slider"),
    ("crank_pin",): ("rod 2", "rocker"),
    ("crank_pin", "slider"): ("rod 2", "rocker", "rod 4", "slider"),
}
_BODIES = ("crank", "rod 2", "rocker", "rod 4", "slider")


@dataclass(frozen=True)
class Plan:
    """Plan of one model's run of a scene.

    Attributes
    ----------
    model, formulation
        The formulation as the model records it with its result.
    integrated, prescribed
        Bodies whose motion is integrated, and those whose motion follows from these and from the crank.
    coordinates, constraints
        Their numbers in the equations.
    contacts
        Possible contacts.
    left_out
        Items not modelled, or modelled but not computed, with the reason.
    expected
        Error and processor time at these settings.
    instead
        Other formulations: setting, description, and ratio of their time.
    """

    model: str
    formulation: str
    integrated: tuple[str, ...]
    prescribed: tuple[str, ...]
    coordinates: int
    constraints: int
    contacts: tuple[str, ...]
    left_out: tuple[tuple[str, str], ...]
    expected: Expected
    instead: tuple[tuple[str, str, float], ...]


def plan(scene: Scene, model: str) -> Plan:
    """Return the plan of a built-in model for a scene.

    Raises
    ------
    ValueError
        If the model belongs to another package.
    """
    if model not in OWN:
        raise ValueError(f"model {model!r}: the plan of another package's model is not known")
    return (_reference if model == "reference" else _exudyn)(scene)


def _reference(scene: Scene) -> Plan:
    free, ideal_slider = joints_with_clearance(scene.data), scene.data["joints"]["slider"] == "ideal"
    rows = 15 if ideal_slider else 13
    whole = f"multiplier (15 coordinates, {rows} multipliers)"
    if scene.data["solver"]["reference"]["formulation"] == "multiplier":
        return _of(scene, "reference", whole, _BODIES, 15, rows, ())
    # The multiplier form has an ideal crank pin.
    paper = (("multiplier", f"the paper's 15 coordinates and {rows} multipliers"),)
    instead = () if "crank_pin" in free else paper
    integrated = _FREE[free]
    return _of(scene, "reference", _CHAIN[free], integrated, len(integrated), 0, instead)


def _exudyn(scene: Scene) -> Plan:
    free, ideal_slider = joints_with_clearance(scene.data), scene.data["joints"]["slider"] == "ideal"
    chosen = scene.data["solver"]["exudyn"]["formulation"]
    bodies = "all five bodies with their joints, in steps that are short in contacts"
    integrated: tuple[str, ...]
    if chosen == "tree":
        if "crank_pin" in free:
            integrated, name = _BODIES[1:], "rocker, rods and slider tree"
        else:
            integrated, name = _BODIES[3:], "rod 4 and slider tree"
        # An ideal slider does not rotate: a point mass at the end of rod 4, constrained by the guide's force.
        count = len(integrated) - (1 if ideal_slider else 0)
        return _of(scene, "exudyn", name, integrated, count, 0, (("full", bodies),))
    # Two rows for each of the pins O, A, B, H, C and F, the drive, and an ideal slider's two.
    rows = 2 * (5 if "crank_pin" in free else 6) + 1 + (2 if ideal_slider else 0)
    smaller = (("tree", "only the free bodies, with error control"),)
    instead = smaller if free and not forces(scene.data) else ()
    return _of(scene, "exudyn", "five bodies", _BODIES, 15, rows, instead)


def _of(
    scene: Scene,
    model: str,
    name: str,
    integrated: tuple[str, ...],
    coordinates: int,
    constraints: int,
    instead: tuple[tuple[str, str], ...],
) -> Plan:
    free = joints_with_clearance(scene.data)
    contacts = ("journal and bearing at the crank pin",) if "crank_pin" in free else ()
    if "slider" in free:
        contact = scene.data["contact"]
        modulus = _of_partners(contact["youngs_modulus"], 1e-9)
        law = f"{contact['law']}; {modulus} GPa, Poisson's ratio {_of_partners(contact['poisson'], 1.0)}"
        contacts = (f"four corners of the slider ({law})", *contacts)
    found, key = expected(scene, model), f"solver.{model}.formulation"
    # Another formulation than the scene's would run at its own usual setting.
    others = {other: expected(scene.variant({key: other}), model).seconds for other, _ in instead}
    return Plan(
        model=model,
        formulation=name,
        integrated=integrated,
        prescribed=tuple(body for body in _BODIES if body not in integrated),
        coordinates=coordinates,
        constraints=constraints,
        contacts=contacts,
        left_out=_left_out(scene, free),
        expected=found,
        instead=tuple(
            (f"{key} = {other!r}", words, others[other] / found.seconds) for other, words in instead
        ),
    )


def _of_partners(number: float | dict[str, float], factor: float) -> str:
    """Return a material's number: of both partners of a contact, or of slider and guide."""
    values = number.values() if isinstance(number, dict) else [number]
    return " on ".join(f"{factor * value:g}" for value in values)


def _left_out(scene: Scene, free: tuple[str, ...]) -> tuple[tuple[str, str], ...]:
    left = []
    if "crank_pin" not in free:
        left.append(("contact at the crank pin", "joints.crank_pin is ideal"))
    if "slider" not in free:
        left.append(("contact of the slider", "joints.slider is ideal"))
    asked = set(scene.data["output"]["groups"])
    corners = "gaps and forces of the corners" if "slider" in free else ""
    journal = "path of the journal" if "crank_pin" in free else ""
    words = {
        "accelerations": "accelerations",
        "corners": " and ".join(part for part in (corners, journal) if part),
        "joints": "reactions and the crank's torque",
        "energy": "energies",
    }
    left += [
        (words[group], "not requested (output.groups)")
        for group in words
        if words[group] and group not in asked
    ]
    return tuple(left)


def lines(made: Plan) -> list[str]:
    """Return a plan as lines for a terminal."""
    integrated = ", ".join(made.integrated) or "nothing: no degree of freedom besides the drive"
    size = f"{made.coordinates} coordinates, {made.constraints} constraints"
    texts = [
        f"{made.model}: {made.formulation}",
        f"  integrates  {integrated}" + (f" ({size})" if made.integrated else ""),
    ]
    if made.prescribed:
        texts.append(
            f"  follows     {', '.join(made.prescribed)}: determined by these and by the crank angle"
        )
    texts.append(f"  contacts    {', '.join(made.contacts) or 'none'}")
    texts += [f"  left out    {what}: {why}" for what, why in made.left_out]
    found = made.expected
    if isfinite(found.error):
        texts.append(f"  error       {found.error:.2g} m of slider_x over {found.span}")
    if isfinite(found.seconds):
        texts.append(f"  time        about {found.seconds:.2g} s on a processor like that of the measurement")
    texts += [f"  beware      {caution}" for caution in found.cautions]
    for setting, words, ratio in made.instead:
        cost = f", {ratio:.2g} times the time" if isfinite(ratio) else ""
        texts.append(f"  instead     {setting}: {words}{cost}")
    return texts


def expectation(scene: Scene, model: str) -> str:
    """Return the expected error and time of a built-in model at a scene's settings."""
    found = expected(scene, model)
    error = f"{found.error:.2g} m" if isfinite(found.error) else "nothing recorded"
    time = f"some {found.seconds:.2g} s" if isfinite(found.seconds) else "no time recorded"
    return "; ".join([f"expected: {error} of slider_x over {found.span}, and {time}", *found.cautions])


def channels_line(scene: Scene) -> str:
    """Return a one-line summary of the scene's requests."""
    groups = ", ".join(["motion", *scene.data["output"]["groups"]])
    cycles = scene.duration / scene.period
    return (
        f"{scene.name}: {cycles:g} cycles at {scene.data['drive']['speed_rpm']:g} rpm, "
        f"{len(channels.expected(scene.data))} channels ({groups})"
    )
