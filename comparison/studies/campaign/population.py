"""The random scenes of the campaign: each number drawn from a range that both models carry to the end.

Three in four scenes have all their numbers drawn. One in four is a shipped scene of which only the start is
moved, by up to 2 % of the clearance: what the shipped verdicts are about, seen from beside.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from comparison.scene import Scene, load_scene
from comparison.studies.shared.scenes import at_tier, clearance_and_start, log_uniform

SEED = 26112026
"""Fixed before any scene of it was run; under 13062026 another law was drawn."""
CYCLES = 2.0
DRAWN_SHARE = 0.1
"""Of the scenes, whose whole family of runs is compared however close the single runs are."""
SHIPPED_SHARE = 0.25
SHIPPED = (
    "150rpm-0.2mm",
    "300rpm-0.2mm",
    "69GPa",
    "90rpm-0.1mm",
    "90rpm-0.5mm",
    "poisson-0.33",
    "both-clearances",
)
"""Whose starts are moved: those with a clearance at the slider, but for the wedge, which starts in walls."""
MOVED = 0.02
"""Of the clearance, the most that a shipped start is moved."""
JOINTS = {"slider": 0.75, "both": 0.2, "crank pin": 0.05}
"""Which joints have clearance, and how often."""
FOUNDATION_SHARE = 0.06

SPEED_RPM = (10.0, 1000.0)
CLEARANCE = (0.05e-3, 1e-3)
MODULUS = (1e9, 400e9)
FOUNDATION_MODULUS = (1e6, 1e9)
"""Pa. With that of a metal the tree takes minutes on a stiff side: half a minute at 5 GPa."""
POISSON = (0.0, 0.45)
RESTITUTION = (0.0, 1.0)
BOUNCY = (0.8, 1.0)
"""Restitution of every second scene: the more a contact leaves, the more contacts and flights follow."""
FRICTION = (0.0, 0.8)
CORNER_RADIUS = (0.2e-3, 5e-3)
GRAVITY = {"usual": 0.6, "none": 0.1, "reversed": 0.1, "drawn": 0.2}
GRAVITY_RANGE = (-20.0, 20.0)
"""m/s^2, where it is drawn."""
_shipped = cache(load_scene)


@dataclass(frozen=True)
class Case:
    """One scene of the campaign."""

    number: int
    """Its place in the population, from 0: with the seed it determines everything else."""
    scene: Scene
    """At the settings of the tight tier."""
    family: bool = False
    """Whether its whole family of runs is compared in any case."""


def cases(count: int, seed: int) -> list[Case]:
    """Draw scenes; scene k of a seed is the same whatever the count."""
    return [case(number, seed) for number in range(count)]


def case(number: int, seed: int) -> Case:
    """Draw one scene."""
    rng = np.random.default_rng([seed, number])
    drawn = _beside_shipped(rng) if rng.uniform() < SHIPPED_SHARE else _anywhere(rng)
    texts = {"scene.name": f"campaign-{number}", "scene.title": f"Scene {number} of the seed {seed}"}
    common = {"drive.cycles": CYCLES, "output.groups": ["accelerations", "corners"]} | texts
    scene = drawn.with_values(common)
    return Case(number, at_tier(scene, "tight"), bool(rng.uniform() < DRAWN_SHARE))


def _beside_shipped(rng: np.random.Generator) -> Scene:
    base = _shipped(str(rng.choice(SHIPPED)))
    start, clearance = base.data["initial"], base.data["clearance"]["slider"]
    length = base.data["mechanism"]["slider"]["length"]
    shift, rotation = MOVED * clearance * rng.uniform(-1.0, 1.0, 2)
    return base.with_values(
        {
            "initial.slider_offset": float(start["slider_offset"] + shift),
            "initial.slider_angle": float(start["slider_angle"] + 2.0 * rotation / length),
        }
    )


def _anywhere(rng: np.random.Generator) -> Scene:
    base = _shipped("paper")
    length = base.data["mechanism"]["slider"]["length"]
    foundation = rng.uniform() < FOUNDATION_SHARE
    with_clearance = str(rng.choice(list(JOINTS), p=list(JOINTS.values())))
    values: dict[str, object] = {
        **clearance_and_start(rng, CLEARANCE, length),
        "mechanism.crank_angle_deg": float(rng.uniform(0.0, 360.0)),
        "drive.speed_rpm": float(rng.choice((-1.0, 1.0))) * log_uniform(rng, SPEED_RPM),
        "joints.slider": "ideal" if with_clearance == "crank pin" else "clearance",
        "joints.crank_pin": "ideal" if with_clearance == "slider" else "clearance",
        "clearance.crank_pin": log_uniform(rng, CLEARANCE),
        "contact.law": "foundation" if foundation else "hertz-corners",
        "contact.youngs_modulus": log_uniform(rng, FOUNDATION_MODULUS if foundation else MODULUS),
        "contact.poisson": float(rng.uniform(*POISSON)),
        "contact.restitution": float(rng.uniform(*(BOUNCY if rng.uniform() < 0.5 else RESTITUTION))),
        "contact.corner_radius": log_uniform(rng, CORNER_RADIUS),
        "friction.coefficient": float(rng.uniform(*FRICTION)),
        "environment.gravity": _gravity(rng),
    }
    return base.with_values(values)


def _gravity(rng: np.random.Generator) -> float:
    kind = str(rng.choice(list(GRAVITY), p=list(GRAVITY.values())))
    drawn = float(rng.uniform(*GRAVITY_RANGE))
    usual = float(_shipped("paper").data["environment"]["gravity"])
    return {"usual": usual, "none": 0.0, "reversed": -usual, "drawn": drawn}[kind]
