"""What each model will integrate of a scene, what it leaves out, and why; what a run costs.

The models choose by themselves; this says the same in words, before anything runs. The contract suite holds
the names and numbers here against what the models record of their runs.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from math import isfinite
from typing import Any

from comparison.accuracy import expected_error
from comparison.channels import expected
from comparison.engines import OWN
from comparison.formulation import forces, loose
from comparison.scene import Scene

_CHAIN = {  # what the equations are written in, by the joints that have clearance
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
    """One model's run of a scene.

    Attributes
    ----------
    model, formulation
        The latter as the model records it with its result.
    integrated, prescribed
        Bodies whose motion is integrated, and those whose motion follows from these and from the crank.
    coordinates, constraints
        How many of each the equations have.
    contacts
        What can touch.
    left_out
        What is not modelled, or modelled and not computed, with the reason.
    error
        Expected of slider_x over the first cycle of the scene 150rpm-0.2mm at these settings, m; nan where it
        is not on record.
    seconds
        Estimated processor time; nan where it is not on record.
    instead
        Other formulations: their setting, what they are, and how many times the time they take.
    """

    model: str
    formulation: str
    integrated: tuple[str, ...]
    prescribed: tuple[str, ...]
    coordinates: int
    constraints: int
    contacts: tuple[str, ...]
    left_out: tuple[tuple[str, str], ...]
    error: float
    seconds: float
    instead: tuple[tuple[str, str, float], ...]


def plan(scene: Scene, model: str) -> Plan:
    """Say what one of our models will do with a scene.

    Raises
    ------
    ValueError
        If the model is another package's: nobody knows but itself.
    """
    if model not in OWN:
        raise ValueError(f"model {model!r}: what another package's model integrates is not known here")
    return (_reference if model == "reference" else _exudyn)(scene)


def _reference(scene: Scene) -> Plan:
    free, ideal_slider = loose(scene.data), scene.data["joints"]["slider"] == "ideal"
    rows = 15 if ideal_slider else 13
    whole = f"multiplier (15 coordinates, {rows} multipliers)"
    if scene.data["solver"]["reference"]["formulation"] == "multiplier":
        return _of(scene, "reference", "multiplier", whole, _BODIES, 15, rows, ())
    kind = "+".join(free) or "ideal"
    # The multiplier form has an ideal crank pin.
    paper = (("multiplier", "multiplier", f"the paper's 15 coordinates and {rows} multipliers"),)
    instead = () if "crank_pin" in free else paper
    integrated = _FREE[free]
    return _of(scene, "reference", kind, _CHAIN[free], integrated, len(integrated), 0, instead)


def _exudyn(scene: Scene) -> Plan:
    free, ideal_slider = loose(scene.data), scene.data["joints"]["slider"] == "ideal"
    chosen = scene.data["solver"]["exudyn"]["formulation"]
    bodies = "all five bodies with their joints, in fixed steps"
    integrated: tuple[str, ...]
    if chosen == "tree":
        kind = "tree " + "+".join(free)
        if "crank_pin" in free:
            integrated, name = _BODIES[1:], "rocker, rods and slider tree"
        else:
            integrated, name = _BODIES[3:], "rod 4 and slider tree"
        # An ideal slider does not turn: a point mass at the end of rod 4, which the guide's force keeps.
        count = len(integrated) - (1 if ideal_slider else 0)
        return _of(scene, "exudyn", kind, name, integrated, count, 0, (("full", "full", bodies),))
    # Two rows for each of the pins O, A, B, H, C and F, the drive, and an ideal slider's two.
    rows = 2 * (5 if "crank_pin" in free else 6) + 1 + (2 if ideal_slider else 0)
    name = "redundant-coordinates" + (", native contact" if chosen == "native" else "")
    smaller = (("tree", f"tree {'+'.join(free)}", "what the drive leaves free alone, with error control"),)
    instead = smaller if free and not forces(scene.data) else ()
    return _of(scene, "exudyn", chosen, name, _BODIES, 15, rows, instead)


def _of(
    scene: Scene,
    model: str,
    kind: str,
    name: str,
    integrated: tuple[str, ...],
    coordinates: int,
    constraints: int,
    instead: tuple[tuple[str, str, str], ...],
) -> Plan:
    free = loose(scene.data)
    contacts = ("journal and bearing at the crank pin",) if "crank_pin" in free else ()
    if "slider" in free:
        contacts = (f"four corners of the slider ({scene.data['contact']['law']})", *contacts)
    seconds = _seconds(scene, model, kind)
    return Plan(
        model=model,
        formulation=name,
        integrated=integrated,
        prescribed=tuple(body for body in _BODIES if body not in integrated),
        coordinates=coordinates,
        constraints=constraints,
        contacts=contacts,
        left_out=_left_out(scene, free),
        error=expected_error(model, scene) if coordinates and free else float("nan"),
        seconds=seconds,
        instead=tuple(
            (f"solver.{model}.formulation = {name!r}", words, _seconds(scene, model, other) / seconds)
            for name, other, words in instead
        ),
    )


def _left_out(scene: Scene, free: tuple[str, ...]) -> tuple[tuple[str, str], ...]:
    left = []
    if "crank_pin" not in free:
        left.append(("contact at the crank pin", "joints.crank_pin is ideal"))
    if "slider" not in free:
        left.append(("contact of the slider", "joints.slider is ideal"))
    asked = set(scene.data["output"]["groups"])
    words = {
        "accelerations": "accelerations",
        "corners": "gaps and forces of the corners",
        "joints": "reactions and the crank's torque",
        "energy": "energies",
    }
    left += [(words[group], "not asked for (output.groups)") for group in words if group not in asked]
    return tuple(left)


def _seconds(scene: Scene, model: str, kind: str) -> float:
    """Estimate the processor time of a run: measured seconds a turn, scaled by the settings."""
    row = _costs()[model].get(kind)
    if row is None:
        return float("nan")
    settings = scene.data["solver"][model]
    # Another formulation than the scene's would run at its own usual setting, which is the table's.
    same = model == "reference" or kind.partition(" ")[0] == settings["formulation"]
    if "step" in row:
        count = scene.duration / (settings["step"] if same else row["step"])
    else:
        count = scene.duration / scene.period
    if "order" in row and same:
        count *= (row["tolerance"] / settings["tolerance"]) ** (1 / row["order"])
    return float(row["start"] + row["seconds"] * count)


def lines(made: Plan) -> list[str]:
    """Return a plan as lines for a terminal."""
    integrated = ", ".join(made.integrated) or "nothing: the drive leaves nothing free"
    size = f"{made.coordinates} coordinates, {made.constraints} constraints"
    told = [
        f"{made.model}: {made.formulation}",
        f"  integrates  {integrated}" + (f" ({size})" if made.integrated else ""),
    ]
    if made.prescribed:
        told.append(
            f"  follows     {', '.join(made.prescribed)}: known from these and from the crank's angle"
        )
    told.append(f"  contacts    {', '.join(made.contacts) or 'none'}")
    told += [f"  left out    {what}: {why}" for what, why in made.left_out]
    if isfinite(made.error):
        told.append(
            f"  error       {made.error:.0e} m of slider_x over the first cycle of 150rpm-0.2mm; other "
            "scenes magnify it by factors of their own"
        )
    if isfinite(made.seconds):
        told.append(f"  time        about {made.seconds:.2g} s of a processor like that of the measurement")
    for setting, words, ratio in made.instead:
        cost = f", {ratio:.2g} times the time" if isfinite(ratio) else ""
        told.append(f"  instead     {setting}: {words}{cost}")
    return told


def expectation(scene: Scene, model: str) -> str:
    """Return the error and the time that are expected of one of our own models at a scene's settings."""
    made = plan(scene, model)
    error = f"{made.error:.0e} m" if isfinite(made.error) else "nothing on record"
    where = "slider_x over the first cycle of 150rpm-0.2mm"
    return f"expected are {error} of {where}, and some {made.seconds:.2g} s"


def channels_line(scene: Scene) -> str:
    """Return what the scene asks for in one line."""
    groups = ", ".join(["motion", *scene.data["output"]["groups"]])
    turns = scene.duration / scene.period
    return (
        f"{scene.name}: {turns:g} turns at {scene.data['drive']['speed_rpm']:g} rpm, "
        f"{len(expected(scene.data))} channels ({groups})"
    )


@cache
def _costs() -> Mapping[str, Any]:
    return tomllib.loads(files("comparison").joinpath("costs.toml").read_text("utf-8"))
