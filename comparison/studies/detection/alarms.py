"""False alarms: each model against itself, with its settings and its start moved by what means nothing.

Of a scene drawn at random, one side runs as the tier has it. The other starts elsewhere in the ball of the
perturbed runs, a billionth of the clearance, and has its tolerance (five bodies: its step) multiplied by a
random factor: numerically another run of the same model. Whatever is called a difference is a false alarm.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from comparison.accuracy.uncertainty import PERTURBATION
from comparison.scene import Scene, load_scene
from comparison.studies.detection import cross_model
from comparison.studies.detection.pairs import Pair
from comparison.studies.detection.tasks import Side
from comparison.studies.shared.scenes import at_tier, clearance_and_start, log_uniform

SEED = 13062025
FACTORS = (0.3, 3.0)
SPEED_RPM = (60.0, 300.0)
CLEARANCE = (0.1e-3, 0.5e-3)
MODULUS = (69e9, 210e9)
RESTITUTION = (0.6, 0.95)
FRICTION = (0.05, 0.3)
_shipped = cache(load_scene)


@dataclass(frozen=True)
class Kind:
    """One model at one tier."""

    label: str
    model: str
    tier: str
    setting: str
    cycles: tuple[float, float]
    """Of the crank, from and to; five bodies are slow."""
    draws: int


KINDS = (
    Kind("reference, tight", "reference", "tight", "tolerance", (0.3, 1.0), 310),
    Kind("rod 4 and slider in Exudyn, tight", "exudyn", "tight", "tolerance", (0.3, 0.3), 305),
    Kind("reference, standard", "reference", "standard", "tolerance", (0.3, 1.0), 310),
    Kind("five bodies in Exudyn, standard", "exudyn", "standard", "step", (0.1, 0.1), 8),
)


def pairs(kind: Kind) -> list[Pair]:
    """Draw all pairs of a kind; the same ones every time."""
    number = [other.label for other in KINDS].index(kind.label)
    return [pair(kind, np.random.default_rng([SEED, number, draw])) for draw in range(kind.draws)]


def pair(kind: Kind, rng: np.random.Generator) -> Pair:
    """Draw a scene and its two sides."""
    drawn = at_tier(scene(rng, kind.cycles), kind.tier)
    return Pair(drawn, Side(drawn, kind.model), Side(moved(drawn, kind, rng), kind.model), kind.tier)


def scene(rng: np.random.Generator, cycles: tuple[float, float]) -> Scene:
    """Draw speed, clearance, material and a start between the walls."""
    base = _shipped("150rpm-0.2mm")
    start = clearance_and_start(rng, CLEARANCE, base.data["mechanism"]["slider"]["length"])
    return base.with_values(
        start
        | {
            "drive.speed_rpm": log_uniform(rng, SPEED_RPM),
            "drive.cycles": round(float(rng.uniform(*cycles)), 3),
            "contact.restitution": float(rng.uniform(*RESTITUTION)),
            "contact.youngs_modulus": log_uniform(rng, MODULUS),
            "friction.coefficient": float(rng.uniform(*FRICTION)),
        }
    )


def moved(drawn: Scene, kind: Kind, rng: np.random.Generator) -> Scene:
    """Return the scene with its start moved within the ball and its setting multiplied."""
    beside = cross_model.moved(drawn, PERTURBATION, rng)
    setting = drawn.data["solver"][kind.model][kind.setting] * log_uniform(rng, FACTORS)
    return beside.variant({f"solver.{kind.model}.{kind.setting}": setting})
