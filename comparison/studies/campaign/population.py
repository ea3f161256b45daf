"""The random scenes of the campaign: three in four drawn from ranges that both models carry to the end.

One in four is a shipped scene of which only the start is moved. One in eight besides has a workpiece, the law
of ADAMS, or both, and one in eight a guide of another material. All numbers are in ``population.toml``.
"""

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any

import numpy as np

from comparison.scene import Scene, load_scene
from comparison.studies.shared.scenes import at_tier, clearance_and_start, log_uniform

DATA: dict[str, Any] = tomllib.loads(
    files("comparison.studies.campaign").joinpath("population.toml").read_text("utf-8")
)
SEED: int = DATA["seed"]
RANGES: dict[str, tuple[float, float, str]] = DATA["ranges"] | DATA["at_work"]
_shipped = cache(load_scene)


@dataclass(frozen=True)
class Case:
    """One scene of the campaign: its place in the population determines, with the seed, everything else."""

    number: int
    scene: Scene  # at the settings of the tight tier
    family: bool = False  # whether its whole family of runs is compared in any case


def cases(count: int, seed: int) -> list[Case]:
    """Draw scenes; scene k of a seed is the same whatever the count."""
    return [case(number, seed) for number in range(count)]


def case(number: int, seed: int) -> Case:
    """Draw one scene."""
    rng = np.random.default_rng([seed, number])
    drawn = _beside_shipped(rng) if rng.uniform() < DATA["shipped_share"] else _anywhere(rng)
    texts = {"scene.name": f"campaign-{number}", "scene.title": f"Scene {number} of the seed {seed}"}
    if number % DATA["every"] == DATA["every"] - 1:
        drawn = _at_work(drawn, np.random.default_rng([seed, number, 1]))
    if number % DATA["every"] == DATA["every"] // 2 - 1:
        drawn = _another_guide(drawn, np.random.default_rng([seed, number, 2]))
    common = {"drive.cycles": DATA["cycles"], "output.groups": ["accelerations", "corners"]}
    scene = at_tier(drawn.with_values(common | texts), "tight")
    return Case(number, scene, bool(rng.uniform() < DATA["family_share"]))


def _beside_shipped(rng: np.random.Generator) -> Scene:
    base = _shipped(str(rng.choice(DATA["shipped"])))
    start, length = base.data["initial"], base.data["mechanism"]["slider"]["length"]
    shift, rotation = DATA["moved"] * base.data["clearance"]["slider"] * rng.uniform(-1.0, 1.0, 2)
    return base.with_values(
        {
            "initial.slider_offset": float(start["slider_offset"] + shift),
            "initial.slider_angle": float(start["slider_angle"] + 2.0 * rotation / length),
        }
    )


def _at_work(base: Scene, rng: np.random.Generator) -> Scene:
    """Return a scene with a workpiece, the law of ADAMS, or both."""
    names = ("damping", "depth of the full damping", "force of the workpiece", "depth of this force")
    damping, full, force, depth = (log_uniform(rng, RANGES[name][:2]) for name in names)
    exponent = float(rng.uniform(*RANGES["exponent of the workpiece"][:2]))
    which = str(rng.choice(["law", "power law", "table", "both"]))
    values: dict[str, object] = {}
    if which in ("law", "both"):
        values |= {"contact.law": "adams-impact", "contact.damping": damping, "contact.damping_depth": full}
    if which != "law":
        values["load.surface"] = DATA["bottom"] + depth
    if which == "table":
        middle = [float(rng.uniform(0.2, 0.8)) * depth, float(rng.uniform(0.0, 1.0)) * force]
        values["load.table"] = [[0.0, 0.0], middle, [depth, force]]
    elif which != "law":
        values |= {"load.force": force, "load.depth": depth, "load.exponent": exponent}
    return base.with_values(values)


def _another_guide(base: Scene, rng: np.random.Generator) -> Scene:
    """Return a scene whose guide is of a material of its own."""
    foundation = base.data["contact"]["law"] == "foundation"
    modulus = log_uniform(rng, RANGES["of a foundation" if foundation else "Young's modulus"][:2])
    poisson = float(rng.uniform(*RANGES["Poisson's ratio"][:2]))
    return base.with_values({"contact.youngs_modulus.guide": modulus, "contact.poisson.guide": poisson})


def _anywhere(rng: np.random.Generator) -> Scene:
    def uniform(name: str) -> float:
        return float(rng.uniform(*RANGES[name][:2]))

    def log(name: str) -> float:
        return log_uniform(rng, RANGES[name][:2])

    base = _shipped("paper")
    foundation = rng.uniform() < DATA["foundation_share"]
    loose = _one_of(rng, DATA["joints"])
    bounds = RANGES["clearances"][:2]
    values: dict[str, object] = {
        **clearance_and_start(rng, bounds, base.data["mechanism"]["slider"]["length"]),
        "mechanism.crank_angle_deg": float(rng.uniform(0.0, 360.0)),
        "drive.speed_rpm": float(rng.choice((-1.0, 1.0))) * log("speed, either sense"),
        "joints.slider": "ideal" if loose == "crank pin" else "clearance",
        "joints.crank_pin": "ideal" if loose == "slider" else "clearance",
        "clearance.crank_pin": log("clearances"),
        "contact.law": "foundation" if foundation else "hertz-corners",
        "contact.youngs_modulus": log("of a foundation" if foundation else "Young's modulus"),
        "contact.poisson": uniform("Poisson's ratio"),
        "contact.restitution": uniform(
            "restitution of every second scene" if rng.uniform() < 0.5 else "restitution"
        ),
        "contact.corner_radius": log("corner radius"),
        "friction.coefficient": uniform("friction"),
    }
    kind, drawn = _one_of(rng, DATA["gravity"]), uniform("gravity, where it is not the usual")
    usual = float(base.data["environment"]["gravity"])
    gravity = {"usual": usual, "none": 0.0, "reversed": -usual, "drawn": drawn}[kind]
    return base.with_values(values | {"environment.gravity": gravity})


def _one_of(rng: np.random.Generator, shares: Mapping[str, float]) -> str:
    return str(rng.choice(list(shares), p=list(shares.values())))


def loose_joints(scene: Scene) -> list[str]:
    """Return the joints that have clearance; the first is the one that moves the slider."""
    return [name for name in ("slider", "crank_pin") if scene.data["joints"][name] == "clearance"]
