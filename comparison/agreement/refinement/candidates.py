"""The settings that could matter to a scene, and one run of each with its processor time."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from math import inf, isnan

from comparison.accuracy.levels import expected
from comparison.accuracy.sweeps import SETTINGS, at, formulations, key_of, model_of
from comparison.agreement.refinement.estimate import CHANNEL
from comparison.execution.run import RunError, run_one
from comparison.models import smallest_in_exudyn
from comparison.scene import Scene, SceneError
from comparison.tables.arrays import Array

EXACT = {"minimal": 1e-13, "tree": 1e-11, "full": 5e-7}
"""Formulation -> its most accurate setting that a minute allows: what the others are held against."""
WARM = 0.02
"""Cycles of the run before, in which code is compiled: its time does not count."""
SHORT = 0.1
"""s of processor time within which a run is repeated up to twice: the least counts."""
_warm: set[str] = set()


@dataclass(frozen=True)
class Candidate:
    """A setting of a formulation.

    Attributes
    ----------
    scene
        At the setting.
    formulation, setting
        By the names of `comparison.accuracy.sweeps`.
    cost
        Expected processor time, s; inf if unknown.
    """

    scene: Scene
    formulation: str
    setting: float
    cost: float

    @property
    def model(self) -> str:
        """The model that has the formulation."""
        return model_of(self.formulation)

    @property
    def key(self) -> str:
        """Dotted key of the setting."""
        return key_of(self.formulation)


@dataclass(frozen=True)
class Timed:
    """One run of a candidate.

    Attributes
    ----------
    candidate
        Which ran.
    status
        ``"success"``, a status of the model, or what kept it from running.
    seconds
        Processor time of the run with its table made and checked, s; nan without a result.
    x
        slider_x, m, shape (n,); None without a result.
    """

    candidate: Candidate
    status: str
    seconds: float
    x: Array | None = None


def candidates(scene: Scene) -> list[Candidate]:
    """Return what can run a scene: first what the others are held against, then the cheapest first.

    Not Exudyn's tree where forces are asked for that only all five bodies have. Multipliers, which take as
    many steps of more work, only where the scene names them.
    """
    tree = smallest_in_exudyn(scene.data) == "tree"
    left_out = set() if tree else {"tree"}
    if scene.data["solver"]["reference"]["formulation"] != "multiplier":
        left_out.add("multiplier")
    names = [name for name in formulations(scene) if name not in left_out]
    exact = [_candidate(scene, name, EXACT[name]) for name in ("minimal", "tree" if tree else "full")]
    others = [_candidate(scene, name, setting) for name in names for setting in SETTINGS[name]]
    known = {(each.formulation, each.setting) for each in exact}
    rest = [each for each in others if (each.formulation, each.setting) not in known]
    return [*exact, *sorted(rest, key=lambda each: each.cost)]


def _candidate(scene: Scene, formulation: str, setting: float) -> Candidate:
    named = at(scene, formulation, setting)
    seconds = expected(named, model_of(formulation)).seconds
    return Candidate(named, formulation, setting, inf if isnan(seconds) else seconds)


def attempt(candidate: Candidate, progress: Callable[[float], None]) -> Timed:
    """Run a candidate and take its time, after a short run that compiles (in a worker)."""
    del progress
    try:
        if candidate.formulation not in _warm:
            per_cycle = candidate.scene.data["output"]["samples_per_cycle"]
            short = max(1, round(WARM * per_cycle)) / per_cycle
            run_one(candidate.scene.variant({"drive.cycles": short}), candidate.model)
            _warm.add(candidate.formulation)
        times: list[float] = []
        while not times or (len(times) < 3 and sum(times) < SHORT):
            begun = time.process_time()
            table = run_one(candidate.scene, candidate.model)
            times.append(time.process_time() - begun)
    except RunError as error:
        return Timed(candidate, error.outcome.status, float("nan"))
    except SceneError as error:
        return Timed(candidate, " ".join(str(error).split()), float("nan"))
    return Timed(candidate, "success", min(times), table.values(CHANNEL))
