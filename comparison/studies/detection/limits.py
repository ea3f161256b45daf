"""The smallest change of one number, given to one model alone, that the verdict still detects.

The search goes by comparisons of five runs a side; only what it ends with is confirmed by ensembles, as any
difference is before it is reported. What is not confirmed is a miss, and the next larger change is tried.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from comparison.execution.job import MODELS, RunError
from comparison.scene import Scene
from comparison.studies.detection.faults import DETECTED, scenes
from comparison.studies.detection.pairs import Pair
from comparison.studies.detection.tasks import Comparison, Found, Side, cached_runs, runs
from comparison.studies.shared.scenes import leaves
from comparison.tables.table import TableError
from comparison.verdict.compare import compare

PARAMETERS = (
    ("Young's modulus", "contact.youngs_modulus", "press"),
    ("restitution", "contact.restitution", "press"),
    ("friction", "friction.coefficient", "press"),
    ("static speed v0", "friction.static_speed", "wide-ramp"),
    ("floor of the impact speed", "contact.impact_speed_floor", "slow-touches"),
    ("corner radius", "contact.corner_radius", "press"),
    ("clearance", "clearance.slider", "press"),
    ("slider's mass", "mechanism.slider.mass", "press"),
    ("slider's inertia", "mechanism.slider.inertia", "press"),
    ("length of rod 4", "mechanism.rod4.length", "press"),
    ("gravity", "environment.gravity", "press"),
)
"""What is changed, its key, and the scene of the catalogue in which it matters."""
PLACES = (("reference", "tight"), ("exudyn", "tight"), ("reference", "standard"))
"""Which model gets the change, at which tier."""
LEAST, MOST = 1e-9, 0.1
"""Relative changes between which the smallest is sought."""
HALVINGS = 6
"""Of the decades between them: 8 / 2^6, so that two changes remain which are 33 % apart."""


@dataclass(frozen=True)
class Search(Comparison):
    """By halving the decades: a change that is found, and a smaller one that is not."""

    scene: Scene
    a: Side
    model: str
    key: str
    tier: str
    halvings: int = HALVINGS

    @property
    def step(self) -> float:
        """Factor from one change to the next larger one."""
        return float((MOST / LEAST) ** 0.5**self.halvings)

    @property
    def sides(self) -> tuple[Side, ...]:
        """The side without the change, and the one that gets it."""
        return self.a, Side(self.scene, self.model)

    @property
    def cost(self) -> float:
        """Expected time, s."""
        return self.halvings * self.sides[1].cost + 0.1 * self.a.cost

    def find(self) -> Found:
        """Return ``found`` and ``missed``, relative changes; None where all or none are found.

        ``shown`` is the smallest that five runs a side show, before anything is confirmed.
        """
        missed = None
        low, high = LEAST, MOST
        if not self.shows(high):
            return {"found": None, "missed": high, "shown": None}
        for _ in range(self.halvings):
            middle = (low * high) ** 0.5
            if self.shows(middle):
                high = middle
            else:
                missed = low = middle
        shown = high
        while not self.confirmed(high):
            missed, high = high, high * self.step
            if high > MOST * self.step**0.5:
                return {"found": None, "missed": missed, "shown": shown}
        return {"found": high, "missed": missed, "shown": shown}

    def pair(self, change: float) -> Pair:
        """Return the comparison with this relative change."""
        value = float(leaves(self.scene.data)[self.key]) * (1.0 + change)
        faulty = self.scene.with_values({self.key: value})
        return Pair(self.scene, self.a, Side(faulty, self.model), self.tier)

    def shows(self, change: float) -> bool:
        """Return whether five runs a side differ with this relative change."""
        try:
            result = compare(cached_runs(self.a), runs(self.pair(change).b), scene=self.scene, tier=self.tier)
        except (RunError, TableError):
            return True
        return result.verdict == "differ"

    def confirmed(self, change: float) -> bool:
        """Return whether the verdict detects this relative change."""
        return self.pair(change).find()["verdict"] in DETECTED


def searches(
    parameters: Sequence[tuple[str, str, str]] = PARAMETERS, halvings: int = HALVINGS
) -> list[Search]:
    """Return all searches: for each parameter, one a place."""
    found = []
    for _, key, name in parameters:
        for model, tier in PLACES:
            scene = scenes(tier)[name]
            other = MODELS[1 - MODELS.index(model)]
            found.append(Search(scene, Side(scene, other), model, key, tier, halvings))
    return found
